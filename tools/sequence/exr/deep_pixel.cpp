#include "tools/sequence/exr/deep_pixel.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <tuple>

namespace postchain::io {
namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();
// At one depth volumes end before surfaces, and begin behind them.
enum EventKind { kEnds, kPoint, kBegins };

void make_valid(DeepSample& sample) {
    if (std::isnan(sample.front)) sample.front = kInfinity;
    sample.alpha = std::isnan(sample.alpha) ? 0 : std::clamp(sample.alpha, 0.0F, 1.0F);
    // An opaque volume is seen at its front alone.
    if (!(sample.back > sample.front) || std::isinf(sample.back - sample.front) ||
        sample.alpha == 1)
        sample.back = sample.front;
}

bool is_behind(const DeepSample& sample, double depth) {
    return double(sample.front) - depth > kDeepGap * std::abs(depth);
}

double optical_depth(float alpha) {
    return -std::log1p(-double(alpha));
}

// (1 - exp(-u)) / u
double mean_transmittance(double u) {
    return u > 1e-9 ? -std::expm1(-u) / u : 1 - u / 2;
}

}  // namespace

void DeepPixel::composite(bool behind) {
    for (DeepSample& sample : samples_) make_valid(sample);
    const auto before = [](const DeepSample& a, const DeepSample& b) {
        return std::tie(a.front, a.back, a.index) < std::tie(b.front, b.back, b.index);
    };
    // Most files are sorted already.
    if (!std::is_sorted(samples_.begin(), samples_.end(), before))
        std::sort(samples_.begin(), samples_.end(), before);
    weights_.assign(samples_.size(), 0);
    surface_ = -1;
    if (samples_.empty()) return;
    size_t first = 0, end = samples_.size();
    weigh(first, end);
    if (behind) {
        // Skips the samples of the surface.
        const size_t surface = find_surface(first, end);
        size_t next = surface;
        double through = 1, depth = double(samples_[surface].back);
        while (next < end && through > kDeepClear && !is_behind(samples_[next], depth)) {
            through *= 1 - double(samples_[next].alpha);
            depth = std::max(depth, double(samples_[next].back));
            ++next;
        }
        weights_.assign(samples_.size(), 0);
        if (next < end)
            first = next;
        else if (through > kDeepClear)
            return;
        else
            first = surface;
        weigh(first, end);
    }
    surface_ = int64_t(samples_[find_surface(first, end)].index);
}

double DeepPixel::alpha() const {
    double sum = 0;
    for (const DeepSample& sample : samples_) sum += weights_[sample.index] * double(sample.alpha);
    return sum;
}

std::optional<size_t> DeepPixel::shown_alone() const {
    std::optional<size_t> alone;
    for (size_t i = 0; i < weights_.size(); ++i) {
        if (weights_[i] == 0) continue;
        if (alone || weights_[i] != 1) return {};
        alone = i;
    }
    return alone;
}

void DeepPixel::weigh(size_t first, size_t end) {
    double through = 1;
    float back = -kInfinity;
    for (size_t i = first; i < end; ++i) {
        const DeepSample& sample = samples_[i];
        // Two surfaces at one depth count as overlapping too.
        const bool overlaps =
            sample.front < back || (i > first && sample.front == samples_[i - 1].front &&
                                    sample.back == samples_[i - 1].back);
        if (overlaps) return weigh_overlapping(first, end);
        back = std::max(back, sample.back);
        weights_[sample.index] = through;
        through *= 1 - double(sample.alpha);
    }
}

// Between two events the light of a volume is seen in proportion to its density. `shown` is the
// integral of what is transmitted, so that each volume's share is a difference of two values.
void DeepPixel::weigh_overlapping(size_t first, size_t end) {
    events_.clear();
    shown_.resize(samples_.size());
    for (size_t i = first; i < end; ++i) {
        const DeepSample& sample = samples_[i];
        if (sample.front == sample.back) {
            events_.push_back({double(sample.front), kPoint, uint32_t(i)});
        } else {
            events_.push_back({double(sample.front), kBegins, uint32_t(i)});
            events_.push_back({double(sample.back), kEnds, uint32_t(i)});
        }
    }
    std::sort(events_.begin(), events_.end(), [](const Event& a, const Event& b) {
        return std::tie(a.at, a.kind, a.sample) < std::tie(b.at, b.kind, b.sample);
    });
    const auto density = [](const DeepSample& sample) {
        return optical_depth(sample.alpha) / (double(sample.back) - double(sample.front));
    };
    double through = 1, shown = 0, densities = 0, at = 0;
    size_t volumes = 0;
    for (size_t e = 0; e < events_.size();) {
        const Event& event = events_[e];
        if (volumes > 0) {
            const double depth = densities * (event.at - at);
            shown += through * mean_transmittance(depth) * (event.at - at);
            through *= std::exp(-depth);
        }
        at = event.at;
        const DeepSample& sample = samples_[event.sample];
        if (event.kind == kBegins) {
            shown_[event.sample] = shown;
            densities += density(sample);
            ++volumes;
            ++e;
        } else if (event.kind == kEnds) {
            const double length = double(sample.back) - double(sample.front);
            const double per_alpha =
                sample.alpha > 0 ? optical_depth(sample.alpha) / double(sample.alpha) : 1;
            weights_[sample.index] = per_alpha / length * (shown - shown_[event.sample]);
            // Removes what rounding leaves.
            densities = --volumes == 0 ? 0 : std::max(0.0, densities - density(sample));
            ++e;
        } else {
            size_t last = e, opaque = 0;
            double depth = 0;
            for (; last < events_.size() && events_[last].at == event.at &&
                   events_[last].kind == kPoint;
                 ++last) {
                const float alpha = samples_[events_[last].sample].alpha;
                if (alpha == 1)
                    ++opaque;
                else
                    depth += optical_depth(alpha);
            }
            for (size_t i = e; i < last; ++i) {
                const DeepSample& one = samples_[events_[i].sample];
                double share = 0;  // of opaque surfaces only, if there are some
                if (opaque > 0)
                    share = one.alpha == 1 ? 1 / double(opaque) : 0;
                else
                    share = mean_transmittance(depth) *
                            (one.alpha > 0 ? optical_depth(one.alpha) / double(one.alpha) : 1);
                weights_[one.index] = through * share;
            }
            through = opaque > 0 ? 0 : through * std::exp(-depth);
            e = last;
        }
    }
}

size_t DeepPixel::find_surface(size_t first, size_t end) const {
    const auto opacity = [&](size_t i) {
        return weights_[samples_[i].index] * double(samples_[i].alpha);
    };
    double whole = 0, sum = 0;
    for (size_t i = first; i < end; ++i) whole += opacity(i);
    // A half-float alpha may miss one half by its last bit.
    constexpr double kHalf = 0.5 * (1 - 1e-3);
    for (size_t i = first; i < end; ++i) {
        sum += opacity(i);
        if (sum >= kHalf * whole) return i;
    }
    return end - 1;
}

}  // namespace postchain::io
