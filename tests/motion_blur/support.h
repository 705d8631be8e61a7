// Small frames for the motion blur tests: color, motion and inverse depth made by hand.
#pragma once

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "tests/support/gpu.h"
#include "tests/support/images.h"

namespace postchain::test {

using Values = std::vector<std::pair<std::string, ParameterValue>>;

// Color black with alpha 1, depth 1, no motion.
struct BlurFrame {
    BlurFrame(int width, int height);

    int width() const { return color().width; }
    int height() const { return color().height; }
    ImageF& color() { return planes.at(Role::color); }
    ImageF& motion() { return planes.at(Role::motion); }
    ImageF& depth() { return planes.at(Role::inverse_depth); }
    const ImageF& color() const { return planes.at(Role::color); }

    // Sets motion so that at shutter 0.5 the half-velocity is (x, y): four times as much.
    void set_half_velocity(int x, int y, double vx, double vy);
    void set_all_half_velocities(double vx, double vy);
    void set_gray(int x, int y, float value);

    FramePlanes planes;
};

// Random content without smooth areas: noise color, noise motion of half-velocities up to `longest`
// px at shutter 0.5 (each component), two depths of ratio `ratio`.
BlurFrame random_frame(int width, int height, float longest, float ratio, uint32_t seed);

// Motion blur with these parameters, without jitter and tile jitter, shutter 0.5.
Chain plain_blur(const Values& values = {});
// Motion blur with these parameters and otherwise defaults.
Chain blur(const Values& values = {});

// Color on the GPU without elision.
ImageF blurred(const Chain& chain, const BlurFrame& frame);
// All stages, with the hint, by name without "0.motion_blur."; without elision.
std::map<std::string, ImageF> stages_of(const Chain& chain, const BlurFrame& frame);
std::map<std::string, ImageD> reference_stages_of(const Chain& chain, const BlurFrame& frame);
// The GPU's color differs from the reference's in at most this share of the pixels.
void expect_reference(const Chain& chain, const BlurFrame& frame, double share);

// |a - b| <= bound * max(1, |b|) in all channels named.
void expect_pixel(const ImageF& image, int x, int y, const std::vector<double>& expected,
                  double bound = 1e-5);

}  // namespace postchain::test
