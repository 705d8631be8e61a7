// Cryptomattes filtered as what they are: the coverage of each id is a plane that is filtered as a
// layer, with color's weights; of each pixel the largest coverages are then ranked anew.
//
//   ranks --ids and where they are--> slots --chunks of layers--> Executor --> ranks
//
// A slot is one channel of a layer. Ids so far apart that the chain moves no light from one to the
// other share one, and slots are filtered some at a time: memory does not grow with their number.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "chain/chain.h"
#include "chain/gl/executor.h"
#include "chain/planner.h"
#include "tools/sequence/run/frame_source.h"

namespace postchain::sequence {

// What became of one cryptomatte.
struct CryptomatteReport {
    std::string name;
    size_t ids = 0;
    size_t planes = 0;          // that were filtered for them
    uint64_t pixels_short = 0;  // in which more ids cover than there are ranks
    float largest_lost = 0;     // coverage of an id that got no rank
};

// Layers of ids that are filtered at a time: as many as 256 MiB hold, at least 1, 16 at most.
int layers_at_once(uint64_t pixels);

// Pixels in which an id covers something, x and y from 0.
std::map<io::CryptoId, io::Window> boxes_of(const io::RankedCoverage& ranks);

// Ids by slot: boxes of one slot are more than `apart_px` pixels from each other.
std::vector<std::vector<io::CryptoId>> slots_of(const std::map<io::CryptoId, io::Window>& boxes,
                                                int apart_px);

// The coverage of ids, slot by slot in the channels of layers one below another. `of` and `to` are
// the windows of the ranks and of the layers.
ImageF coverage_layers(const io::RankedCoverage& ranks, const io::Window& of, const io::Window& to,
                       const std::map<io::CryptoId, size_t>& slots, int layers);

// The frame's cryptomattes, filtered, in the order of FrameLayers::cryptomattes. `plan` is that of
// the frame, which has run. Errors: of make_plan() and Executor::filter().
Result<std::vector<io::RankedCoverage>> filter_cryptomattes(
    const Chain& chain, const Plan& plan, const SourceFrame& frame, const PlanOptions& options,
    Executor& executor, std::vector<CryptomatteReport>& reports);

// Id, coverage, id, coverage of two ranks as the file stores them.
ImageF stored_level(const io::RankedCoverage& ranks, int level);

}  // namespace postchain::sequence
