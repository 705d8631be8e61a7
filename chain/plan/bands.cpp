#include "chain/plan/bands.h"

#include <algorithm>

#include "shaders/shared/work_group.h"

namespace postchain {
namespace {

constexpr unsigned kMaxGroups = 65535;  // a side of a dispatch that every device allows
constexpr double kThreads = shared::kBlockPx * shared::kBlockPx;

}  // namespace

double taps_of_group(const Step& step) {
    double taps = double(step.group_taps);
    if (step.group_taps == 0)
        taps = double(step.taps) / (double(step.groups[0]) * step.groups[1] * step.groups[2]);
    return std::max(taps, kThreads);
}

Band Bands::next(double groups) {
    const auto at_most = [](double value, unsigned limit) {
        return unsigned(std::clamp(value, 1.0, double(std::min(limit, kMaxGroups))));
    };
    Band band{next_, {at_most(groups, columns_ - next_[0]), 1}};
    if (band.count[0] == columns_) band.count[1] = at_most(groups / columns_, rows_ - next_[1]);
    next_[0] += band.count[0];
    if (next_[0] < columns_) return band;
    next_ = {0, next_[1] + band.count[1]};
    return band;
}

}  // namespace postchain
