// The Gaussian of an unset blur_sigma_px, by hand: for a lens a quarter of the larger |R| at
// infinity and at 20 focal lengths; for planes and range half of the largest radius; never below
// downsample / 2.
//
// The lens is f 50 mm, f/2, sensor 32 mm, W = 640: f_px = 1000, A = 0.025, R = 12.5 (1/s - w) px;
// 20 f = 1 m, so w = 1 there; |R| <= 19.2 px.
#include <gtest/gtest.h>

#include <cmath>

#include "passes/depth_of_field/gilham.h"
#include "tests/depth_of_field/support.h"
#include "tests/support/status.h"

namespace postchain::test::sigma_test {
namespace {

using depth_of_field::GilhamSizes;
using depth_of_field::Parameters;
using lens::CocSource;

struct Case {
    double expected;  // sigma, px
    double focus = 2, f_stop = 2;
    int width = 640, downsample = 1;
    bool breathing = false;
    std::optional<double> max_radius_px = {}, blur_sigma_px = {};
};

FrameDescription frame_of(const Case& one) {
    FrameDescription frame;
    frame.width = frame.display_width = one.width;
    frame.height = frame.display_height = 360;
    frame.camera.focal_length_mm = 50;
    frame.camera.f_stop = one.f_stop;
    frame.camera.focus_distance = one.focus;
    frame.camera.sensor_width_mm = 32;
    return frame;
}

Parameters parameters_of(const Case& one) {
    Parameters parameters;
    parameters.downsample = one.downsample;
    parameters.blur_sigma_px = one.blur_sigma_px;
    parameters.lens.breathing = one.breathing;
    parameters.lens.max_radius_px = one.max_radius_px;
    return parameters;
}

GilhamSizes gilham_sizes(const Parameters& parameters, const FrameDescription& frame) {
    const auto coc =
        must(lens::circle_of_confusion(parameters.lens, frame, lens::kSmallMaxRadiusFraction));
    return must(depth_of_field::gilham_sizes(parameters, coc, frame));
}

double sigma_px(const Parameters& parameters, const FrameDescription& frame) {
    const GilhamSizes sizes = gilham_sizes(parameters, frame);
    return sizes.low_sigma[0] * sizes.factor;
}

// Unset: the largest of 1, 2, 4 that is at most the deviation. The radius at infinity is 12.5 px at
// f/2 and scales with the aperture: sigma 3.125 -> 2, 6.25 -> 4, 1.5625 -> 1; 2 and 4 themselves
// count; 0.39 -> 1, where the deviation is kept at half a box edge.
TEST(auto_downsample, follows_sigma) {
    const std::pair<double, int> by_lens[] = {{2, 2},     {1, 4},      {4, 1},     {3.125, 2},
                                              {3.126, 1}, {1.5625, 4}, {1.563, 2}, {16, 1}};
    for (const auto& [f_stop, factor] : by_lens)
        EXPECT_EQ(gilham_sizes({}, frame_of({.focus = 1, .f_stop = f_stop})).factor, factor)
            << f_stop;
    EXPECT_NEAR(sigma_px({}, frame_of({.focus = 1, .f_stop = 16})), 0.5, 1e-12);
    EXPECT_NEAR(sigma_px({}, frame_of({.focus = 1, .f_stop = 4})), 1.5625, 1e-12);
    const std::pair<double, int> set[] = {{0, 1}, {1.99, 1}, {2, 2}, {3.99, 2}, {4, 4}, {90, 4}};
    Parameters parameters;
    for (const auto& [sigma, factor] : set) {
        parameters.blur_sigma_px = sigma;
        EXPECT_EQ(gilham_sizes(parameters, frame_of({})).factor, factor) << sigma;
    }
}

// s = 1: infinity 12.5, 20 f: 0: 12.5/4 = 3.125.
// s = 1.25: infinity 10, 20 f: 12.5 (0.8 - 1) = -2.5: 2.5.
// s = 2: both 6.25: 1.5625, the minimum.
// s = 5: infinity 2.5, 20 f: 12.5 (0.2 - 1) = -10: 2.5.
// Focus at infinity: infinity 0, 20 f: -12.5: 3.125.
// s = f (1 + 2^-40): infinity 12.5/0.05 = 250, clamped to 19.2.
TEST(auto_sigma, lens_by_hand) {
    const Case cases[] = {{.expected = 3.125, .focus = 1},
                          {.expected = 2.5, .focus = 1.25},
                          {.expected = 1.5625, .focus = 2},
                          {.expected = 2.5, .focus = 5},
                          {.expected = 3.125, .focus = 1e30},
                          {.expected = 3.125, .focus = INFINITY},
                          {.expected = 4.8, .focus = 0.05 * (1 + 0x1p-40)},
                          {.expected = 3.125, .f_stop = 1},
                          {.expected = 3.125, .width = 1280},
                          {.expected = 1.5625 * 2 / 1.95, .breathing = true},  // times s/(s - f)
                          {.expected = 3.125, .focus = INFINITY, .breathing = true},
                          {.expected = 1, .max_radius_px = 4},
                          {.expected = 0.25, .blur_sigma_px = 0.25},  // whatever the box
                          // Half a box: the copy blurs by that anyway.
                          {.expected = 0.5, .f_stop = 200},
                          {.expected = 1, .f_stop = 1e12, .downsample = 2},
                          {.expected = 2, .f_stop = INFINITY, .downsample = 4},
                          {.expected = 2, .downsample = 4}};
    for (const Case& one : cases)
        EXPECT_NEAR(sigma_px(parameters_of(one), frame_of(one)), one.expected, 1e-12)
            << &one - cases;
    EXPECT_EQ(gilham_sizes(parameters_of({.downsample = 4}), frame_of({})).full_blur_px, 4);
    // The frame's content has no influence, because the blur would flicker with it.
    FrameDescription frame = frame_of({});
    frame.bounds.min_inverse_depth = 0.5;
    frame.bounds.max_inverse_depth = 20;
    EXPECT_EQ(sigma_px(parameters_of({}), frame), 1.5625);
}

// Half of max(0.015, 0.005) 640 = 9.6 px; of 0.005 * 640 = 3.2 px; of a limit of 6 px; and for
// range half of 0.03 * 640 = 19.2 px. Neither needs a lens.
TEST(auto_sigma, planes_and_range_by_hand) {
    FrameDescription frame = frame_of({});
    frame.camera = {};
    Parameters parameters = parameters_of({});
    parameters.lens.coc = CocSource::planes;
    EXPECT_NEAR(sigma_px(parameters, frame), 4.8, 1e-12);
    parameters.lens.max_near_fraction = 0;
    EXPECT_NEAR(sigma_px(parameters, frame), 1.6, 1e-12);
    parameters.lens.max_far_fraction = 0;
    EXPECT_NEAR(sigma_px(parameters, frame), 0.5, 1e-12) << "half a box";
    parameters.lens.max_near_fraction = 0.1;
    parameters.lens.max_radius_px = 6;
    EXPECT_NEAR(sigma_px(parameters, frame), 3, 1e-12);
    parameters = parameters_of({});
    parameters.lens.coc = CocSource::range;
    parameters.lens.focus = 3;
    EXPECT_NEAR(sigma_px(parameters, frame), 9.6, 1e-12);
}

// On the GPU, lens of round_camera(): R = 32 (1/4 - w), 20 f = 0.72: |R| = 36.4, clamped to 19.2:
// sigma 4.8, full blur from 9.6 px on. At |R| = (0.5 + 9.6)/2 the weight is 1/2: a dot of 2 among
// 0 in one row keeps 1/2 * 2 and gets 1/2 * 2 g(0), g(0) = 1/sum of exp(-i^2/(2 4.8^2)) over
// |i| <= 15.
TEST(auto_sigma, weight_and_kernel_on_the_gpu) {
    ImageF color(41, 1, 4);
    color.at(20, 0) = 2;
    const FramePlanes planes = flat_planes(std::move(color), float(0.25 + 5.05 / 32));
    double total = 1;
    for (int i = 1; i <= 15; ++i) total += 2 * std::exp(-i * i / (2 * 4.8 * 4.8));
    EXPECT_NEAR(dof(planes, {{"downsample", int64_t(1)}}).at(20, 0), 1 + 1 / total, 1e-5);
}

}  // namespace
}  // namespace postchain::test::sigma_test
