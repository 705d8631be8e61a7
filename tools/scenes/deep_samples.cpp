#include "tools/scenes/deep_samples.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace postchain::scenes {
namespace {

using Rgba = std::array<float, 4>;  // premultiplied

// The smallest half that is not below `alpha`, 0 to 1: the file has no other.
double half_above(double alpha) {
    const double step = std::exp2(std::max(std::ilogb(alpha), -14) - 10);
    return std::ceil(alpha / step) * step;
}

// Splits a pixel S, whose alpha is below 1, into a front sample F over k B: F + (1 - F.a) k B = S.
// From the alpha follows 1 - F.a = (1 - S.a) / (1 - k B.a), and F >= 0 demands in each channel
//   k <= S / (B (1 - S.a) + S B.a).
// k is 1 if F covers the whole pixel evenly, as glass does. An edge covers some parts of the pixel
// and shows B in others; F may then hide more of B than an even cover can.
void split(Rgba& front, Rgba& back) {
    const double s = double(front[3]), b = double(back[3]);
    double k = 1;
    for (size_t c = 0; c < 4; ++c) {
        const double most = double(back[c]) * (1 - s) + double(front[c]) * b;
        if (double(front[c]) < k * most) k = double(front[c]) / most;
    }
    for (float& value : back) value = float(k * double(value));
    const double alpha = half_above(1 - (1 - s) / (1 - k * b));
    for (size_t c = 0; c < 3; ++c)
        front[c] = float(std::max(0.0, double(front[c]) - (1 - alpha) * double(back[c])));
    front[3] = float(alpha);
}

}  // namespace

io::DeepSamples deep_samples(const ScenePlanes& sharp, const ScenePlanes& behind) {
    io::DeepSamples samples{sharp.color.width, sharp.color.height, {}, {}};
    for (const char* name : {"R", "G", "B", "A"})
        samples.channels.push_back({name, io::PixelType::half, {}});
    for (const char* name : {"Z", "motion.x", "motion.y", "motion_back.x", "motion_back.y"})
        samples.channels.push_back({name, io::PixelType::float32, {}});
    const auto add = [&](const ScenePlanes& planes, size_t pixel, const Rgba& color, float depth) {
        const float* v = &planes.vectors.data[4 * pixel];
        const float values[] = {color[0], color[1], color[2], color[3], depth,
                                -v[2],    v[3],     -v[0],    v[1]};
        for (size_t c = 0; c < std::size(values); ++c)
            samples.channels[c].values.push_back(values[c]);
    };
    for (size_t pixel = 0; pixel < sharp.color.pixels(); ++pixel) {
        Rgba front, back;
        std::copy_n(&sharp.color.data[4 * pixel], 4, front.begin());
        std::copy_n(&behind.color.data[4 * pixel], 4, back.begin());
        const bool hides = front != back || sharp.depth.data[pixel] != behind.depth.data[pixel];
        if (hides && front[3] < 1) split(front, back);
        // Keeps the order of two surfaces that touch.
        const float depth = sharp.depth.data[pixel],
                    next = std::nextafter(depth, std::numeric_limits<float>::max());
        add(sharp, pixel, front, depth);
        if (hides) add(behind, pixel, back, std::max(behind.depth.data[pixel], next));
        samples.counts.push_back(hides ? 2 : 1);
    }
    return samples;
}

}  // namespace postchain::scenes
