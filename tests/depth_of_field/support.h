// Frames for the tests of depth of field, and helpers to filter them.
#pragma once

#include <string>

#include "passes/common/lens_samples.h"
#include "passes/depth_of_field/depth_of_field.h"
#include "tests/support/gpu.h"
#include "tests/support/images.h"
#include "tests/support/moments.h"
#include "tests/support/plans.h"

namespace postchain::test {

// Color and one inverse depth for all pixels.
FramePlanes flat_planes(ImageF color, float inverse_depth);

// Gray light and inverse depth of each pixel: at(x, y).
struct Pixel {
    double light;
    float depth;
};
template <class F>
FramePlanes planes_at(int width, int height, const F& at) {
    return planes_of(
        make_image(width, height, 4,
                   [&](int x, int y, int c) { return c < 3 ? at(x, y).light : 1; }),
        make_image(width, height, 1, [&](int x, int y, int) { return at(x, y).depth; }));
}

// Noise color over three layers of depth: sky above, the focus plane, a near block.
FramePlanes deep_planes(int width, int height, uint32_t seed = 3);

// Filters a frame of describe_round() without elision, with method gilham unless the settings name
// another.
ImageF dof(const FramePlanes& planes, Settings settings);
Stages dof_stages(const FramePlanes& planes, Settings settings);
ReferenceFrame dof_reference(const FramePlanes& planes, Settings settings);

// A point light at (48, 48) of 97 x 97 pixels that are `x`, `y` from the corner of a 6400 x 3600
// display, with 1023 lens samples. R = 32 (1/4 - w) px.
ImageF dot(float inverse_depth, Settings settings, int x = 0, int y = 0,
           const BokehKernel& image = {}, double pixel_aspect = 1);

// "0.depth_of_field." + name
std::string stage(const std::string& name);

double sum_of(const ImageF& image, int channel = 0);

// All lens samples have equal light.
Moments moments_of(const lens::Points& points);

}  // namespace postchain::test
