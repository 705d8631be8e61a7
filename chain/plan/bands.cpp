#include "chain/plan/bands.h"

#include <algorithm>
#include <cmath>

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

double BandRates::of(unsigned program) const {
    const auto known = rates_.find(program);
    return known == rates_.end() ? kUnknownRate : known->second;
}

// The mean of the newest time and the earlier ones: a single one may be of an idle or a busy
// device.
void BandRates::add(unsigned program, double taps, double ms, double most) {
    if (!(taps > 0)) return;
    const double rate = std::min(taps / std::max(ms, 1e-3), most);
    const auto [known, is_new] = rates_.try_emplace(program, rate);
    if (!is_new) known->second = 0.5 * (known->second + rate);
}

double groups_of_band(unsigned columns, unsigned rows, double ms_of_group) {
    const double all = double(columns) * rows, ms = all * ms_of_group;
    if (ms <= kBandMs) return all;
    const double share = all / std::ceil(ms / kBandMs), of_row = double(columns) * ms_of_group;
    if (share < columns) return std::ceil(columns / std::ceil(columns / share));
    const double up = std::ceil(share / columns), down = std::floor(share / columns);
    const bool short_enough = up * of_row <= kBandMs || down * of_row < kLeastBandMs;
    return columns * (short_enough ? up : down);
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

Launch launch_of(const Plan& plan, const Step& step) {
    auto columns = unsigned(step.groups[0]), rows = unsigned(step.groups[1]);
    const double taps = taps_of_group(step);
    if (step.work_list >= 0) {
        const auto blocks = unsigned(plan.textures[size_t(step.work_list)].width);
        columns = shared::kGroupsPerRow;
        rows = (blocks + columns - 1) / columns;
        if (blocks * taps <= kBandTaps) return {true};
    }
    return {false, Bands(columns, rows), kBandTaps / taps};
}

bool bands_wait(const Step& step) {
    return std::ranges::any_of(step.bindings, [&](const Binding& written) {
        return written.access == Access::write &&
               std::ranges::any_of(step.bindings, [&](const Binding& read) {
                   return read.texture == written.texture && read.access != Access::write;
               });
    });
}

}  // namespace postchain
