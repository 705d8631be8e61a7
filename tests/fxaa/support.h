// Images and helpers shared by the FXAA tests.
#pragma once

#include <gtest/gtest.h>

#include <string>
#include <utility>
#include <vector>

#include "passes/fxaa/reference.h"
#include "tests/support/gpu.h"
#include "tests/support/images.h"

namespace postchain::test {

using SettingList = std::vector<std::pair<std::string, ParameterValue>>;

// Settings with which FXAA works on stored values throughout, without a hint.
SettingList stored_settings(const SettingList& more = {});

Chain fxaa_chain(const SettingList& settings);
fxaa::Parameters parameters_of(const SettingList& settings);

// The frame of a color plane and, unless empty, a hint plane.
FramePlanes planes_of(const ImageF& color, const ImageF& hint = {});

ImageF run(const SettingList& settings, const ImageF& color, const ImageF& hint = {});

// Stage "luma" of the GPU.
ImageF luma_on_gpu(const Chain& chain, const FrameDescription& frame, const FramePlanes& planes,
                   Precision precision = Precision::fp32);

// An opaque gray image of function(x, y).
template <class Function>
ImageF gray_image(int width, int height, Function function) {
    ImageF image(width, height, 4, 1.0f);
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x)
            for (int c = 0; c < 3; ++c) image.at(x, y, c) = float(function(x, y));
    return image;
}

// 16 x 8 pixels with a horizontal border between rows 3 and 4.
inline ImageF border(double above, double below) {
    return gray_image(16, 8, [&](int, int y) { return y < 4 ? above : below; });
}

ImageF constant_hint(int width, int height, float tile, float pixel);

// A gray half-plane below a slanted line, value `low` above and `high` below, slope dy/dx, edge at
// y = offset for x = 0. `samples` per axis and pixel; 1 = aliased.
ImageF slanted_edge(int width, int height, double slope, double offset, double low, double high,
                    int samples);

}  // namespace postchain::test
