// Filters cryptomattes by coverage: each id's coverage is filtered like a layer, with color's
// weights; then each pixel's ids are ranked again.
//
//   ranks --ids and their boxes--> slots --chunks of layers--> Executor --> ranks
//
// A slot is one channel of a layer. Ids too far apart for the chain to move light between them
// share a slot. Slots are filtered in chunks, so memory does not grow with the number of ids.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "chain/chain.h"
#include "chain/gl/executor.h"
#include "chain/planner.h"
#include "tools/sequence/run/frame_source.h"

namespace postchain::sequence {

struct CryptomatteReport {
    std::string name;
    size_t ids = 0;
    size_t planes = 0;          // planes that were filtered
    uint64_t pixels_short = 0;  // pixels covered by more ids than there are ranks
    float largest_lost = 0;     // largest coverage of an id that got no rank
};

// Number of layers per chunk: as many as fit in 256 MiB, from 1 to 16.
int layers_at_once(uint64_t pixels);

// Bounding box of each id's coverage; x and y count from 0.
std::map<io::CryptoId, io::Window> boxes_of(const io::RankedCoverage& ranks);

// Assigns ids to slots; boxes in one slot are more than `apart_px` pixels apart.
std::vector<std::vector<io::CryptoId>> slots_of(const std::map<io::CryptoId, io::Window>& boxes,
                                                int apart_px);

// Coverage of ids, slot by slot in the channels of stacked layers. `of` is the window of the ranks,
// `to` that of the layers.
ImageF coverage_layers(const io::RankedCoverage& ranks, const io::Window& of, const io::Window& to,
                       const std::map<io::CryptoId, size_t>& slots, int layers);

// The frame's filtered cryptomattes, in the order of FrameLayers::cryptomattes. `plan` is the
// frame's plan, which has run. Errors: those of make_plan() and Executor::filter().
Result<std::vector<io::RankedCoverage>> filter_cryptomattes(
    const Chain& chain, const Plan& plan, const SourceFrame& frame, const PlanOptions& options,
    Executor& executor, std::vector<CryptomatteReport>& reports);

// Two ranks as the file stores them: id, coverage, id, coverage.
ImageF stored_level(const io::RankedCoverage& ranks, int level);

}  // namespace postchain::sequence
