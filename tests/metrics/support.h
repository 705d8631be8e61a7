// Images computed from a function of position.
#pragma once

#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "tests/support/status.h"
#include "tools/metrics/pair.h"

namespace postchain::metrics {

using Rgb = std::array<double, 3>;

// f(x, y) -> Rgb
template <class F>
ImageF make_image(int width, int height, F&& f) {
    ImageF image(width, height, 3);
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
            const Rgb rgb = f(x, y);
            for (int c = 0; c < 3; ++c) image.at(x, y, c) = float(rgb[size_t(c)]);
        }
    return image;
}

inline ImageF gray(int width, int height, double v) {
    return ImageF(width, height, 3, float(v));
}

// The scene value that is displayed as d.
inline double shown_as(double d) {
    const double v = std::pow(d, 2.2);
    return v / (1 - v);
}

inline Pair pair(const ImageF& test, const ImageF& reference) {
    return postchain::test::must(pair_of(test, reference));
}
inline RgbImage one(const ImageF& image) {
    return test::must(rgb_image_of(image));
}

}  // namespace postchain::metrics
