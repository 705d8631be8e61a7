// Filters cryptomattes by coverage: each id's coverage is filtered like a layer, with color's
// weights; then each pixel's ids are ranked again.
//
//   ranks --ids and their boxes--> slots --runs of as many layers as fit--> Executor --> ranks
//
// A slot is one channel of a layer. Ids too far apart for the chain to move light between them
// share a slot; ids near each other share a layer. The first run filters color too. There are as
// many runs as memory demands.
#pragma once

#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "chain/gl/executor.h"
#include "chain/pass/chain.h"
#include "chain/pass/planner.h"
#include "tools/sequence/source/frame_plan.h"

namespace postchain::sequence {

struct CryptomatteReport {
    std::string name;
    size_t ids = 0;
    size_t removed = 0;         // ids that were not asked for
    size_t planes = 0;          // planes that were filtered
    uint64_t pixels_short = 0;  // pixels covered by more ids than there are ranks
    float largest_lost = 0;     // largest coverage of an id that got no rank
};

// Bounding box of each id's coverage; x and y count from 0.
std::map<io::CryptoId, io::Window> boxes_of(const io::RankedCoverage& ranks);

// Assigns ids to slots; boxes in one slot are more than `apart_px` pixels apart.
std::vector<std::vector<io::CryptoId>> slots_of(const std::map<io::CryptoId, io::Window>& boxes,
                                                int apart_px);

// Adds the coverage of ids, slot by slot in the channels of stacked layers. `of` is the window of
// the ranks, `to` that of the layers.
void add_coverage(const io::RankedCoverage& ranks, const io::Window& of, const io::Window& to,
                  const std::map<io::CryptoId, size_t>& slots, ImageF& stack);

// Ids that share a channel of a layer.
struct CoverageSlot {
    size_t cryptomatte;  // index in FrameLayers::cryptomattes
    std::vector<io::CryptoId> ids;
};

// Slots that are filtered together.
struct CoverageRun {
    std::set<Neighbor> neighbors;  // that have these cryptomattes
    std::vector<CoverageSlot> slots;
    bool with_color = false;  // and with the frame's own layers

    int layers() const { return int(slots.size() + 3) / 4; }
};

// `plan`: the frame's plan without ids. Empty if cryptomattes stay as rendered. At most one run is
// with color.
std::vector<CoverageRun> coverage_runs(const Chain& chain, const FramePlan& plan,
                                       const SourceFrame& frame, const PlanOptions& options);

// The description with which a run is planned, from that of the frame's plan.
FrameDescription described(const CoverageRun& run, const SourceFrame& frame,
                           FrameDescription description);

// Filters a frame that has SourceFrame::cryptomattes. Errors: those of make_plan() and
// Executor::filter().
class CryptomatteFilter {
  public:
    // `plan`: the frame's plan without ids; `planes`: its inputs. Refers to its other arguments.
    CryptomatteFilter(const Chain& chain, const FramePlan& plan, const SourceFrame& frame,
                      SharedPlanes planes, const PlanOptions& options, Executor& executor);

    // The outputs of `plan`, filtered with as many ids as fit.
    Result<FramePlanes> filter_color(const StageObserver& observer);
    // After that: the filtered cryptomattes, in the order of FrameLayers::cryptomattes; empty if
    // they stay as rendered.
    Result<std::vector<io::RankedCoverage>> filter_rest(std::vector<CryptomatteReport>& reports);

  private:
    struct CryptomatteState {
        std::map<io::CryptoId, io::Window> boxes;
        size_t all_ids = 0;
        size_t planes = 0;
        io::Reranking ranking;
    };
    ImageF stacked(const CoverageRun& run, std::optional<Neighbor> neighbor) const;
    Result<FramePlanes> filter(const CoverageRun& run, const StageObserver& observer);

    const Chain& chain_;
    const FramePlan& plan_;
    const SourceFrame& frame_;
    const SharedPlanes planes_;
    const PlanOptions& options_;
    Executor& executor_;
    std::vector<CoverageRun> runs_;
    int reach_px_ = 0;
    std::vector<CryptomatteState> states_;
};

// Two ranks as the file stores them: id, coverage, id, coverage.
ImageF stored_level(const io::RankedCoverage& ranks, int level);

}  // namespace postchain::sequence
