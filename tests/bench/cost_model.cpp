#include "tests/bench/cost_model.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <optional>

#include "tests/bench/amd_compiler.h"

namespace postchain::bench {
namespace {

std::vector<double> ranks_of(const std::vector<double>& values) {
    std::vector<size_t> order(values.size());
    std::iota(order.begin(), order.end(), size_t(0));
    std::sort(order.begin(), order.end(),
              [&](size_t a, size_t b) { return values[a] < values[b]; });
    std::vector<double> ranks(values.size());
    for (size_t i = 0; i < order.size();) {
        size_t end = i;
        while (end < order.size() && values[order[end]] == values[order[i]]) ++end;
        for (size_t k = i; k < end; ++k) ranks[order[k]] = 0.5 * double(i + end - 1);
        i = end;
    }
    return ranks;
}

// Texels of this binding; none: the listing does not tell.
std::optional<double> texels_of(const Binding& binding, const std::map<uint32_t, double>& texels) {
    constexpr uint32_t kSampler = 96, kImage = 32;
    const bool sampled = binding.access == Access::sample_nearest;
    const auto found =
        texels.find(sampled ? uint32_t(binding.unit) * kSampler
                            : kFirstImage * kSampler + uint32_t(binding.unit) * kImage);
    return found == texels.end() ? std::nullopt : std::optional(found->second);
}

}  // namespace

double StepCost::ms(const Rates& on) const {
    double all = std::max({instructions[0] / on.instructions, kWave * texels / on.texels,
                           bytes / on.bytes}) *
                 1e3;
    if (waves < kLatencyWaves * on.schedulers) all = std::max(all, longest_ms);
    return all + (waits ? kLevelMs : 0);
}

double texel_cost(Format format) {
    const int bytes = bytes_per_pixel(format);
    return bytes <= 8 ? 1 : channels_of(format) * 2 == bytes ? 2 : 4;
}

double fetch_cost(const Plan& plan, const Step& step, const Instructions& all) {
    double cost = 0;
    for (const auto& [descriptor, texels] : all.texels) cost += texels;
    for (const Binding& binding : step.bindings)
        if (binding.access == Access::sample_nearest || binding.access == Access::read)
            cost += texels_of(binding, all.texels).value_or(0) *
                    (texel_cost(plan.textures[size_t(binding.texture)].format) - 1);
    return cost;
}

double moved_bytes(const Plan& plan, const Step& step, const Instructions& all, double share) {
    double bytes = 0;
    for (const Binding& binding : step.bindings) {
        const PlanTexture& texture = plan.textures[size_t(binding.texture)];
        const auto texels = texels_of(binding, step.writes(binding) ? all.stored : all.texels);
        const double whole = share * double(texture.bytes());
        bytes +=
            texels ? std::min(whole, kWave * *texels * bytes_per_pixel(texture.format)) : whole;
    }
    return bytes;
}

double rank_correlation(const std::vector<double>& a, const std::vector<double>& b) {
    const std::vector<double> x = ranks_of(a), y = ranks_of(b);
    const double mean = 0.5 * double(x.size() - 1);
    double xy = 0, xx = 0, yy = 0;
    for (size_t i = 0; i < x.size(); ++i) {
        xy += (x[i] - mean) * (y[i] - mean);
        xx += (x[i] - mean) * (x[i] - mean);
        yy += (y[i] - mean) * (y[i] - mean);
    }
    return xy / std::sqrt(xx * yy);
}

}  // namespace postchain::bench
