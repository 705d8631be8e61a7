// method: inverse_warp against closed forms and against its reference.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/depth_of_field/support.h"

namespace postchain::test::inverse_warp_test {
namespace {

const std::pair<std::string, ParameterValue> kMethod = {"method", "inverse_warp"};

// An out-of-focus point light becomes an evenly lit disc: rings of equal area have equal light.
// (Its radii: pixel_aspect_test.cpp.)
TEST(InverseWarpLens, DotBecomesAnEvenDisc) {
    const double radius = 32 * (1 - 0.25);  // near: w = 1
    const ImageF out = dot(1, {});
    const double inside = 1 / (M_PI * radius * radius);
    for (int ring = 0; ring < 4; ++ring) {
        double sum = 0;
        int count = 0;
        for (int y = 0; y < 97; ++y)
            for (int x = 0; x < 97; ++x) {
                const double part = (std::pow(x - 48, 2) + std::pow(y - 48, 2)) / (radius * radius);
                if (part < 0.25 * ring || part >= 0.25 * (ring + 1)) continue;
                sum += out.at(x, y);
                ++count;
            }
        // The disc's rim is between pixels.
        EXPECT_NEAR(sum / count, inside, (ring < 3 ? 0.1 : 0.15) * inside) << ring;
    }
}

// At such a lens 1e-5 of depth is half a pixel of radius: surfaces keep 22 bits of depth.
TEST(InverseWarpLens, SteepLensKeepsInFocusWhatIsNextToTheFocus) {
    const auto before_sky = [](float inverse_depth) {
        ImageF depth(64, 32, 1, 0);
        for (int y = 0; y < 32; ++y)
            for (int x = 0; x < 32; ++x) depth.at(x, y) = inverse_depth;
        return dof(planes_of(noise_image(64, 32, 4, 5), std::move(depth)),
                   {kMethod, {"f_stop", 0.002}, {"focus_distance", 0.1}});
    };
    // R = 5760 px (10 - w)
    EXPECT_LT(compare(before_sky(10 * (1 - 1e-6f)), before_sky(10), 1e-3).max, 1e-3);
    EXPECT_GT(compare(before_sky(10 * (1 - 3e-5f)), before_sky(10), 1e-3).max, 0.1);
}

// A focused surface before an unfocused one keeps every bit away from its edge.
TEST(InverseWarpLens, FocusedForegroundDoesNotTakeFromTheBackground) {
    const ImageF noise = noise_image(128, 64, 1, 5);
    const FramePlanes planes = planes_at(128, 64, [&](int x, int y) {
        return x < 64 ? Pixel{50, 0.25f} : Pixel{noise.at(x, y), 0};  // in focus; sky, 8 px
    });
    const ImageF out = dof(planes, {kMethod});
    for (int y = 0; y < 64; ++y) {
        for (int x = 0; x < 64; ++x) EXPECT_EQ(out.at(x, y), 50) << x;
        for (int x = 66; x < 128; ++x) EXPECT_LE(out.at(x, y), 1) << x;
    }
}

// Near the edge of an out-of-focus near surface the lens sees past it: an edge becomes the disc's
// share on its side.
TEST(InverseWarpLens, NearEdgeFadesAsADiscCutByALine) {
    const FramePlanes planes = planes_at(160, 64, [](int x, int) {
        return x < 80 ? Pixel{1, 0.75f} : Pixel{0, 0.25f};  // 16 px; in focus
    });
    const ImageF out = dof(planes, {kMethod, {"samples", int64_t(512)}});
    for (int x = 60; x < 100; ++x) {
        const double d = std::clamp((x + 0.5 - 80) / 16, -1.0, 1.0);
        const double covered = (std::acos(d) - d * std::sqrt(1 - d * d)) / M_PI;
        // Edges are accurate to a pixel.
        EXPECT_NEAR(out.at(x, 32), covered, 0.05) << x;
    }
}

// The surface occluded by a near bar is interpolated from its two sides. The focused background's
// color is its column, the bar's color the center column.
TEST(InverseWarpLens, HiddenBackgroundIsBetweenWhatShowsAround) {
    const FramePlanes planes = planes_at(160, 64, [](int x, int) {
        const bool near = x >= 72 && x < 88;
        return near ? Pixel{79.5, 0.75f} : Pixel{double(x), 0.25f};  // 16 px; in focus
    });
    const ImageF out = dof(planes, {kMethod, {"samples", int64_t(512)}});
    const auto left_of = [](double d) {
        d = std::clamp(d / 16, -1.0, 1.0);
        return 1 - (std::acos(d) - d * std::sqrt(1 - d * d)) / M_PI;
    };
    for (int x = 72; x < 88; ++x) {
        const double covered = left_of(88 - (x + 0.5)) - left_of(72 - (x + 0.5));
        const double behind = (out.at(x, 32) - 79.5 * covered) / (1 - covered);
        // The closest cell with visible background on either side; in the center there is one on
        // both.
        EXPECT_NEAR(behind, x, std::abs(x - 79.5) < 4 ? 2 : 9) << x;
    }
}

TEST(LensSamples, EverySetIsEvenOverTheDisc) {
    for (const int count : {1, 7, 32, 1023}) {
        const lens::Points points = lens::lens_samples({}, count);
        ASSERT_GE(points.sets, 1);
        for (int set = 0; set < points.sets; ++set) {
            double x = 0, y = 0, squared = 0;
            for (int i = 0; i < count; ++i) {
                const auto p = points.at(i, set);
                EXPECT_LE(std::hypot(p[0], p[1]), 1.0001);
                x += p[0] / count, y += p[1] / count;
                squared += (p[0] * p[0] + p[1] * p[1]) / count;
            }
            EXPECT_NEAR(squared, 0.5, 1e-3);
            if (count >= 32) {
                EXPECT_LT(std::hypot(x, y), 0.05);
            }
        }
    }
}

}  // namespace
}  // namespace postchain::test::inverse_warp_test
