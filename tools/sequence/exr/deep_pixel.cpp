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
    // Only the front of an opaque volume is seen.
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

// Its limit for an alpha of 0 is 1.
double depth_per_alpha(const DeepSample& sample) {
    return sample.alpha > 0 ? optical_depth(sample.alpha) / double(sample.alpha) : 1;
}

double length_of(const DeepSample& volume) {
    return double(volume.back) - double(volume.front);
}

double density_of(const DeepSample& volume) {
    return optical_depth(volume.alpha) / length_of(volume);
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
        // Two surfaces at one depth overlap too.
        const bool overlaps =
            sample.front < back || (i > first && sample.front == samples_[i - 1].front &&
                                    sample.back == samples_[i - 1].back);
        if (overlaps) return weigh_overlapping(first, end);
        back = std::max(back, sample.back);
        weights_[sample.index] = through;
        through *= 1 - double(sample.alpha);
    }
}

// Overlapping samples, as events in the order of their depth. Between two events the light of a
// volume is seen in proportion to its density.
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
    Ray ray;
    for (size_t e = 0; e < events_.size();) {
        advance(ray, events_[e].at);
        if (events_[e].kind == kPoint) {
            e = pass_points(ray, e);
            continue;
        }
        if (events_[e].kind == kBegins)
            begin_volume(ray, events_[e].sample);
        else
            end_volume(ray, events_[e].sample);
        ++e;
    }
}

void DeepPixel::advance(Ray& ray, double to) {
    if (ray.volumes > 0) {
        const double depth = ray.density * (to - ray.at);
        ray.shown += ray.through * mean_transmittance(depth) * (to - ray.at);
        ray.through *= std::exp(-depth);
    }
    ray.at = to;
}

void DeepPixel::begin_volume(Ray& ray, size_t i) {
    shown_[i] = ray.shown;
    ray.density += density_of(samples_[i]);
    ++ray.volumes;
}

void DeepPixel::end_volume(Ray& ray, size_t i) {
    const DeepSample& sample = samples_[i];
    weights_[sample.index] = depth_per_alpha(sample) / length_of(sample) * (ray.shown - shown_[i]);
    // Removes rounding errors.
    ray.density = --ray.volumes == 0 ? 0 : std::max(0.0, ray.density - density_of(sample));
}

size_t DeepPixel::pass_points(Ray& ray, size_t first) {
    size_t end = first, opaque = 0;
    double depth = 0;
    for (; end < events_.size() && events_[end].at == ray.at && events_[end].kind == kPoint;
         ++end) {
        const float alpha = samples_[events_[end].sample].alpha;
        if (alpha == 1)
            ++opaque;
        else
            depth += optical_depth(alpha);
    }
    for (size_t e = first; e < end; ++e) {
        const DeepSample& sample = samples_[events_[e].sample];
        double share = 0;  // opaque surfaces hide the others
        if (opaque == 0)
            share = mean_transmittance(depth) * depth_per_alpha(sample);
        else if (sample.alpha == 1)
            share = 1 / double(opaque);
        weights_[sample.index] = ray.through * share;
    }
    ray.through = opaque > 0 ? 0 : ray.through * std::exp(-depth);
    return end;
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
