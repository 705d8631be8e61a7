// The joint blur against closed forms and against its reference.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <numbers>

#include "passes/common/aperture.h"
#include "shaders/shared/small_circles.h"
#include "tests/support/gpu.h"
#include "tests/support/images.h"
#include "tests/support/layers.h"
#include "tests/support/moments.h"

namespace postchain::test {
namespace {

// Black, at one inverse depth, with one motion both ways.
FramePlanes moving_plane(int width, int height, float inverse_depth, float x_px, float y_px) {
    FramePlanes planes;
    planes[Role::color] = constant_image(width, height, {0, 0, 0, 1});
    planes[Role::inverse_depth] = ImageF(width, height, 1, inverse_depth);
    planes[Role::motion] = constant_image(width, height, {x_px, y_px});
    return planes;
}

ImageF filtered(const Chain& chain, const FramePlanes& planes) {
    return filter(chain, describe_round(planes), planes, {.elide = false}).at(Role::color);
}

// A dot becomes a disc of radius R moved along its path: variances add.
TEST(JointBlur, DotBecomesADiscMovedAlongItsPath) {
    FramePlanes planes = moving_plane(129, 97, 0.75f, 48, 0);  // R = -16 px, a path of 24 px
    for (int c = 0; c < 3; ++c) planes[Role::color].at(64, 48, c) = 1;
    const Chain chain = chain_of("joint_blur", {{"samples", int64_t(1023)}});
    const Moments m = moments_of(filtered(chain, planes), 64, 48);
    EXPECT_NEAR(m.light, 1, 0.03);
    EXPECT_NEAR(m.yy, 16 * 16 / 4.0, 3);
    EXPECT_NEAR(m.xx, 16 * 16 / 4.0 + 24 * 24 / 12.0, 4);
}

// A dot in focus under steps of 2 px between n samples: n dots of equal light, whose center is the
// dot's.
TEST(JointBlur, TimesAreCenteredForAnyNumberOfSamples) {
    for (const int n : {1, 2, 3, 4, 5, 6, 7, 12, 16, 24, 31}) {
        // The open time is half a frame.
        FramePlanes planes = moving_plane(97, 9, 0.25f, float(4 * n), 0);
        for (int c = 0; c < 3; ++c) planes[Role::color].at(48, 4, c) = 1;
        const Chain chain =
            chain_of("joint_blur",
                     {{"samples", int64_t(n)}, {"noise", std::string("none")}, {"denoise", false}});
        const ImageF out = filtered(chain, planes);
        for (int x = 0; x < 97; ++x) {
            const int steps = std::abs(x - 48);
            const bool lit = steps < n && steps % 2 != n % 2;
            EXPECT_NEAR(out.at(x, 4), lit ? 1.0 / n : 0, 1e-4) << n << " " << x - 48;
        }
    }
}

// Frames without motion_back have programs of their own.
TEST(JointBlur, WithoutMotionBackAsWithEqualVectorsToTheBit) {
    TestFrame frame = layered_frame(101, 67, {40.0f, 9.0f}, {-23.0f, 5.0f});
    add_neighbors(frame);
    frame.description.camera.f_stop = 0.5;
    FramePlanes without = frame.planes;
    frame.planes[Role::motion_back] = frame.planes.at(Role::motion);
    frame.description.planes.add(Role::motion_back);
    FrameDescription described = frame.description;
    for (const Role role : {Role::motion_back, role_of(Neighbor::before, Role::motion_back),
                            role_of(Neighbor::after, Role::motion_back)}) {
        without.erase(role);
        described.planes.remove(role);
    }
    for (const char* pass : {"joint_blur", "motion_blur"}) {
        const Chain chain = chain_of(pass, {});
        const ImageF out = filter(chain, described, without).at(Role::color);
        EXPECT_EQ(out.data, filter(chain, frame.description, frame.planes).at(Role::color).data)
            << pass;
        EXPECT_NE(out.data, without.at(Role::color).data) << pass;
    }
}

// A square, beside whose edges lamps are, before ground that continues behind it, and neighbors of
// other light: the same at every exposure.
TEST(JointBlur, IsLinearInExposure) {
    TestFrame frame = layered_frame(101, 67, {40.0f, 9.0f}, {-23.0f, 5.0f});
    add_neighbors(frame);
    for (int y = 10; y < 60; y += 9)
        for (int x = 30; x < 70; x += 7)
            for (int c = 0; c < 3; ++c) frame.planes[Role::color].at(x, y, c) = 30;
    for (const char* pass : {"motion_blur", "depth_of_field", "joint_blur"}) {
        const Chain chain = chain_of(pass, {});
        const auto exposed = [&](float exposure) {
            FramePlanes planes = frame.planes;
            for (const Role role : {Role::color, Role::color_before, Role::color_after})
                for (size_t i = 0; i < planes[role].data.size(); ++i)
                    if (i % 4 != 3) planes[role].data[i] *= exposure;
            return filtered(chain, planes);
        };
        const ImageF one = exposed(1);
        for (const float exposure : {0.05f, 1000.0f}) {
            const ImageF other = exposed(exposure);
            for (size_t i = 0; i < one.data.size(); ++i) {
                const double scale = i % 4 == 3 ? 1 : double(exposure);
                ASSERT_NEAR(other.data[i] / scale, one.data[i],
                            1e-5 * std::max(1.0, double(one.data[i])))
                    << pass << " times " << exposure << ", " << i / 4 % 101 << "," << i / 404;
            }
        }
    }
}

// The factor by which a disc of this radius, px, dims a wave of k radians a pixel.
double disc_of_wave(double k, double radius) {
    return radius > 0 ? 2 * std::cyl_bessel_j(1.0, k * radius) / (k * radius) : 1;
}

TEST(SmallCircles, WeightsBlurAsADisc) {
    static constexpr float kWeights[] = {SMALL_CIRCLES_WEIGHTS};
    static_assert(std::size(kWeights) == SMALL_CIRCLES_RADII * SMALL_CIRCLES_PLACES);
    for (int row = 0; row < SMALL_CIRCLES_RADII; ++row) {
        SCOPED_TRACE(row);
        const double radius = SMALL_CIRCLES_STEP * row;
        const auto blur_of = [&](double kx, double ky) {
            double sum = 0;
            for (int y = -SMALL_CIRCLES_REACH_PX; y <= SMALL_CIRCLES_REACH_PX; ++y)
                for (int x = -SMALL_CIRCLES_REACH_PX; x <= SMALL_CIRCLES_REACH_PX; ++x) {
                    const int longer = std::max(std::abs(x), std::abs(y));
                    const int place =
                        longer * (longer + 1) / 2 + std::min(std::abs(x), std::abs(y));
                    sum += double(kWeights[row * SMALL_CIRCLES_PLACES + place]) *
                           std::cos(kx * x + ky * y);
                }
            return sum;
        };
        EXPECT_NEAR(blur_of(0, 0), 1, 1e-4);
        for (const double k : {0.3, 0.8, 1.3, 1.8, 2.3})
            for (const double angle : {0.0, 0.3, 0.6, std::numbers::pi / 4})
                EXPECT_NEAR(blur_of(k * std::cos(angle), k * std::sin(angle)),
                            disc_of_wave(k, radius), 0.006)
                    << k << " at " << angle;
    }
}

// A still wall of slanted waves with circles of this radius, px, in front of the focus or behind.
FramePlanes waves_with_circles(double radius, double wave) {
    FramePlanes planes = moving_plane(80, 64, float(0.25 - radius / 32), 0, 0);
    for (int y = 0; y < 64; ++y)
        for (int x = 0; x < 80; ++x)
            for (int c = 0; c < 3; ++c)
                planes[Role::color].at(x, y, c) =
                    float(0.5 + 0.3 * wave * std::sin(1.2 * x + 0.7 * y));
    return planes;
}

TEST(SmallCircles, OfOneStillSurfaceAreExact) {
    const double k = std::hypot(1.2, 0.7);
    for (const char* pass : {"depth_of_field", "joint_blur"})
        for (const double radius : {0.8, 1.0, 1.4, 2.8, 3.95, -0.8, -1.0, -1.4, -2.8, -3.95}) {
            SCOPED_TRACE(concat(pass, ", radius ", radius));
            const Chain chain = chain_of(pass, {{"samples", int64_t(8)}});
            const ImageF out = filtered(chain, waves_with_circles(radius, 1));
            const FramePlanes exact = waves_with_circles(radius, disc_of_wave(k, std::abs(radius)));
            for (int y = 16; y < 48; ++y)
                for (int x = 16; x < 64; ++x)
                    ASSERT_NEAR(out.at(x, y), exact.at(Role::color).at(x, y), 0.0015)
                        << x << "," << y;
        }
}

// At borders and beside a nearer square, whose circles are others, and with blades: as the
// reference, which sums the same pixels. With five blades all are sampled.
TEST(SmallCircles, AreThoseOfTheReference) {
    for (const float nearer : {1.045f, 2.5f}) {  // less and more than a depth edge
        FramePlanes planes = waves_with_circles(1.3, 1);
        for (int y = 20; y < 30; ++y)
            for (int x = 34; x < 44; ++x) planes[Role::inverse_depth].at(x, y) *= nearer;
        const FrameDescription frame = describe_round(planes);
        for (const int64_t blades : {0, 5, 6, 9}) {
            SCOPED_TRACE(concat(nearer, " times nearer, ", blades, " blades"));
            const auto chain = [&](int64_t samples) {
                return chain_of("depth_of_field",
                                {{"samples", samples}, {"aperture_blades", blades}});
            };
            const auto out = [&](int64_t samples) {
                return filter(chain(samples), frame, planes, {.elide = false}).at(Role::color);
            };
            const auto expected = reference(chain(8), frame, planes, {.elide = false});
            const Difference difference = compare(out(8), expected.planes.at(Role::color), 1e-4);
            EXPECT_LE(difference.fraction, 0.004) << difference.text;
            EXPECT_EQ(out(8).at(8, 8) == out(16).at(8, 8), blades != 5);
        }
    }
}

// Layers get the weights of color: from circles that change nothing, over those that come in, to
// whole ones, and beside lamps, where negative weights are left out.
TEST(SmallCircles, LayersSumToColor) {
    TestFrame frame;
    frame.planes = waves_with_circles(0, 1);
    for (int y = 0; y < 64; ++y)
        for (int x = 0; x < 80; ++x) {
            frame.planes[Role::inverse_depth].at(x, y) = float(0.25 - (0.3 + x / 80.0) / 32);
            if (x % 16 == 7 && y % 16 == 7)
                for (int c = 0; c < 3; ++c) frame.planes[Role::color].at(x, y, c) = 50;
        }
    frame.description = describe_round(frame.planes);
    add_lights(frame, 5);
    const Chain chain = chain_of("depth_of_field", {{"samples", int64_t(8)}});
    const auto out = filter(chain, frame.description, frame.planes, {.elide = false});
    const ImageF &color = out.at(Role::color), &given = frame.planes.at(Role::color);
    EXPECT_LE(relative_difference(sum_of_layers(out.at(Role::layers), 64), color), 1e-6);
    EXPECT_EQ(color.at(0, 20), given.at(0, 20));
    EXPECT_LT(color.at(71, 39), 25);
    EXPECT_GT(color.at(72, 39), 2 * given.at(72, 39));
}

// The variance of a regular polygon of radius 1 is (2 + cos(2 pi / n)) / 12 along each axis, a
// disc's is a quarter.
TEST(SmallCircles, RoundAperturesHaveADisc) {
    const auto with_blades = [](int blades) { return lens::Aperture{.blades = blades}; };
    EXPECT_EQ(lens::disc_radius(with_blades(0)), 1);
    for (const int blades : {6, 7, 11})
        EXPECT_NEAR(lens::disc_radius(with_blades(blades)).value(),
                    std::sqrt((2 + std::cos(2 * std::numbers::pi / blades)) / 3), 1e-5);
    EXPECT_NEAR(lens::disc_radius({.blades = 3, .curvature = 1}).value(), 1, 1e-6);
    EXPECT_FALSE(lens::disc_radius(with_blades(5)));
    EXPECT_FALSE(lens::disc_radius({.ratio = 0.5}));
    EXPECT_FALSE(lens::disc_radius({.cats_eye = 0.5}));
    EXPECT_FALSE(lens::disc_radius({.axes = {1, 0.5}}));
}

// All light is the firefly's, so every pixel has its color: its own pixel, which few samples see,
// leaves no rounding that denoising would spread.
TEST(JointBlur, LightOfAFireflyKeepsItsColor) {
    FramePlanes planes = moving_plane(97, 65, 0.75f, 48, 20);
    const float firefly[] = {1e10f, 0.7e10f, 0.3e10f};
    std::copy_n(firefly, 3, planes[Role::color].pixel(48, 32));
    const ImageF out = filtered(chain_of("joint_blur"), planes);
    size_t lit = 0;
    double worst = 0;
    for (size_t i = 0; i < out.data.size(); i += 4) {
        const double light = out.data[i];
        if (light == 0) continue;
        ++lit;
        worst = std::max({worst, std::abs(out.data[i + 1] / light - 0.7),
                          std::abs(out.data[i + 2] / light - 0.3)});
    }
    EXPECT_GT(lit, 500u);
    EXPECT_LT(worst, 3e-5);
}

// A surface that moves along rows is denoised along rows: lines one pixel wide stay lines.
TEST(JointBlur, DenoisingStaysWithinTheStreak) {
    FramePlanes planes = moving_plane(160, 96, 0.25f, 60, 0);
    planes[Role::color] =
        make_image(160, 96, 4, [](int, int y, int c) { return c == 3 || y % 2 == 0; });
    const ImageF out = filtered(chain_of("joint_blur"), planes);
    for (int y = 20; y < 76; ++y) EXPECT_NEAR(out.at(80, y), y % 2 == 0 ? 1 : 0, 0.01) << y;
}

// Along a diagonal the determinant of the covariance is a small difference of large products.
TEST(JointBlur, DenoisingOfDiagonalStreaksNeedsNoMoreThanHalves) {
    const PlanOptions options = {.precision = Precision::fp16, .elide = false};
    const Chain chain = chain_of("joint_blur", {});
    for (const auto& [x, y] :
         {std::array{199.0f, 187.0f}, std::array{61.0f, -43.0f}, std::array{150.0f, 35.0f}}) {
        FramePlanes planes = moving_plane(131, 77, 0.25f, x, y);
        planes[Role::color] = noise_image(131, 77, 4, 5);
        for (float& value : planes[Role::color].data) value = std::floor(1024 * value) / 1024;
        FrameDescription frame = describe_round(planes);
        frame.bounds.color_is_half = true;
        const ImageF out = filter(chain, frame, planes, options).at(Role::color);
        const ImageD expected = reference(chain, frame, planes, options).planes.at(Role::color);
        const Difference difference = compare(out, expected, 0.005);
        EXPECT_LE(difference.fraction, 0.001) << x << ", " << y << ": " << difference.text;
    }
}

TEST(JointBlur, BlocksThatNothingIsBlurredIntoChangeNoBit) {
    FramePlanes planes = moving_plane(190, 140, 0.25f, 0, 0);
    planes[Role::color] = noise_image(190, 140, 4, 9);
    for (int y = 30; y < 50; ++y)
        for (int x = 40; x < 60; ++x) {
            planes[Role::inverse_depth].at(x, y) = 0.6f;
            planes[Role::motion].at(x, y) = 20;
        }
    const FrameDescription frame = describe_round(planes);
    const PlanOptions complete = {.rules_off = {"unblurred_blocks"}};
    const Chain chain = chain_of("joint_blur", {});
    const ImageF with = filter(chain, frame, planes).at(Role::color);
    EXPECT_TRUE(equal_bits(with, filter(chain, frame, planes, complete).at(Role::color)));
    EXPECT_FALSE(equal_bits(with, planes[Role::color]));
    for (int x = 150; x < 190; ++x) EXPECT_EQ(with.at(x, 130), planes[Role::color].at(x, 130)) << x;
}

// An edge that moves by 2 half_path: 64 even samples, as shown at 0.5 -+ half, half of them on each
// side in the pixels beside it. Their mean has the noise half / 8, the displacements of an even
// streak the second moment half_path^2 / 3. The gate begins at 0.002 and 1 px and is full at 0.006
// and 4 px.
TEST(JointBlur, TheHintGrowsWithNoiseAndBlur) {
    struct Case {
        double half, half_path;
    };
    for (const Case& one :
         {Case{0.2, 12}, {0.032, 12}, {0.024, 12}, {0.015, 12}, {0.2, 3}, {0.2, 1}})
        for (const bool mirrored : {false, true}) {
            SCOPED_TRACE(concat(one.half, ", ", one.half_path, " px, mirrored: ", mirrored));
            const float speed = float(4 * one.half_path);  // open for half a frame
            FramePlanes planes = moving_plane(96, 33, 0.25f, mirrored ? -speed : speed, 0);
            planes[Role::color] = make_image(96, 33, 4, [&](int x, int, int c) {
                const double shown = 0.5 + ((x < 48) == mirrored ? one.half : -one.half);
                return c == 3 ? 1.0f : float(shown * shown / (1 - shown * shown));
            });
            const PlanOptions options = {.elide = false, .outputs = {Role::color, Role::hint}};
            const ImageF hint =
                filter(chain_of("joint_blur"), describe_round(planes), planes, options)
                    .at(Role::hint);
            const double noise = one.half / 8, radius = std::sqrt(2.0 / 3) * one.half_path;
            const double expected = std::clamp((noise - 0.002) / 0.004, 0.0, 1.0) *
                                    std::clamp((radius - 1) / 3, 0.0, 1.0);
            for (const int x : {47, 48}) EXPECT_NEAR(hint.at(x, 16, 1), expected, 0.06) << x;
            EXPECT_EQ(hint.at(47 - 30, 16, 1), 0);  // the same on both sides
            EXPECT_EQ(hint.at(48 + 30, 16, 1), 0);
        }
}

// A disc that moves before a still wall with a fine texture, all in focus, filtered as by balanced:
// the wall keeps its bits, and FXAA acts on the disc.
TEST(JointBlur, FxaaKeepsWhatIsStillAndInFocus) {
    for (const bool mirrored : {false, true}) {
        FramePlanes planes = moving_plane(160, 101, 0.2f, 0, 0);
        const ImageF random = noise_image(160, 101, 1, 13);
        const auto at = [&](int x) { return mirrored ? 159 - x : x; };
        for (int y = 0; y < 101; ++y)
            for (int x = 0; x < 160; ++x) {
                const bool disc = std::hypot(x - 60, y - 50) < 20;
                for (int c = 0; c < 3; ++c)
                    planes[Role::color].at(at(x), y, c) = random.at(x, y) * (disc ? 2 : 1);
                planes[Role::inverse_depth].at(at(x), y) = disc ? 0.4f : 0.2f;
                planes[Role::motion].at(at(x), y, 0) = disc ? (mirrored ? -40.0f : 40.0f) : 0.0f;
            }
        FrameDescription frame = describe_round(planes);
        frame.camera.f_stop = 1e9;
        Chain chain = chain_of("joint_blur", {{"samples", int64_t(28)}});
        const ImageF blurred = filter(chain, frame, planes).at(Role::color);
        append(chain, "fxaa", {{"mode", "directional"}, {"where", "blurred"}});
        const ImageF out = filter(chain, frame, planes).at(Role::color);
        int filtered_pixels = 0;
        for (int y = 0; y < 101; ++y)
            for (int x = 0; x < 160; ++x) {
                // The disc passes within half of its path, 10 px, and a bilinear sample.
                if (std::hypot(std::max(std::abs(x - 60) - 10, 0), y - 50) > 22)
                    ASSERT_EQ(out.at(at(x), y), planes.at(Role::color).at(at(x), y))
                        << x << ' ' << y;
                else
                    filtered_pixels += out.at(at(x), y) != blurred.at(at(x), y);
            }
        EXPECT_GT(filtered_pixels, 1000) << "mirrored: " << mirrored;
    }
}

}  // namespace
}  // namespace postchain::test
