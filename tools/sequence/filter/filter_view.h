// Filters a planned frame: color, extra layers, cryptomattes and the fill mask.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "tools/sequence/filter/cryptomatte_filter.h"

namespace postchain::sequence {

// The filtered planes of one view.
struct FilteredView {
    ImageF color;
    ImageF layers;                                 // stacked; empty = the file's own stay
    ImageF fill_mask;                              // layers/fill_mask.h; empty = not asked for
    std::vector<io::RankedCoverage> cryptomattes;  // empty = the file's own stay
    std::vector<CryptomatteReport> reports;        // one for each of `cryptomattes`
};

// `plan`: that of plan_source_frame(). `observer`: of the run that filters color. `color_is_done`:
// called after that run, before further runs for layers and ids. Errors: those of make_plan() and
// Executor::filter().
Result<FilteredView> filter_view(const Chain& chain, const FramePlan& plan,
                                 const SourceFrame& source, const PlanOptions& options,
                                 Executor& executor, const StageObserver& observer = {},
                                 const std::function<void()>& color_is_done = {});

// A line for each cryptomatte that has visibly lost coverage. `path`: of the frame's color.
std::vector<std::string> lost_coverage(const std::vector<CryptomatteReport>& reports,
                                       const std::string& path);

}  // namespace postchain::sequence
