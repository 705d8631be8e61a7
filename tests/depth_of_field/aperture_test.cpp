// Aperture shape: closed forms of its lens samples, and of the image of a point light.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <functional>
#include <set>

#include "shaders/shared/lens_samples_uniforms.h"
#include "tests/depth_of_field/support.h"
#include "tests/support/status.h"

namespace postchain::test {
namespace {

using lens::Aperture;

// Lens samples are cached by this hash.
TEST(Aperture, EveryValueIsInItsHash) {
    const Aperture plain = {.blades = 5};
    std::set<uint64_t> hashes = {hash_of(plain)};
    const std::function<void(Aperture&)> changes[] = {
        [](Aperture& a) { a.blades = 6; },      [](Aperture& a) { a.rotation_deg = 0.5; },
        [](Aperture& a) { a.curvature = 0.5; }, [](Aperture& a) { a.ratio = 0.5; },
        [](Aperture& a) { a.cats_eye = 0.5; },  [](Aperture& a) { a.axes[0] = 0.5; },
        [](Aperture& a) { a.axes[1] = 0.5; }};
    for (const auto& change : changes) {
        Aperture other = plain;
        change(other);
        hashes.insert(hash_of(other));
    }
    EXPECT_EQ(hashes.size(), 1 + std::size(changes));
}

// A regular polygon with its corners on the unit circle: mean of x^2 is (2 + cos(2 pi/n))/12.
TEST(Aperture, PointsFillAPolygonEvenly) {
    for (const int blades : {3, 4, 5, 6, 9, 16})
        for (const int count : {32, 1023}) {
            const Moments m =
                moments_of(lens::lens_samples({.blades = blades, .rotation_deg = 23}, count));
            const double expected = (2 + std::cos(2 * M_PI / blades)) / 12;
            EXPECT_NEAR(m.xx, expected, 0.005) << blades;
            EXPECT_NEAR(m.yy, expected, 0.005) << blades;
            EXPECT_NEAR(std::hypot(m.x, m.y), 0, 0.005) << blades;
        }
}

// Equal steps along the outline sweep equal areas; their sum is the polygon's area plus the
// segments added by curved blades: (a - sin a)/(2 c^2) each, sin(a/2) = c sin(pi/n).
TEST(Aperture, OutlineSweepsEqualAreas) {
    for (const int blades : {3, 5, 8})
        for (const double curvature : {0.0, 0.3, 0.9}) {
            const lens::Outline outline({.blades = blades, .curvature = curvature});
            double area = blades / 2.0 * std::sin(2 * M_PI / blades);
            if (curvature > 0) {
                const double a = 2 * std::asin(curvature * std::sin(M_PI / blades));
                area += blades * (a - std::sin(a)) / (2 * curvature * curvature);
            }
            constexpr int kSectors = 15, kSteps = 400;
            for (int sector = 0; sector < kSectors; ++sector) {
                double swept = 0;
                for (int i = 0; i < kSteps; ++i) {
                    const double turn = (sector + double(i) / kSteps) / kSectors;
                    const auto p = outline.at(turn), q = outline.at(turn + 1.0 / kSteps / kSectors);
                    swept -= 0.5 * (p[0] * q[1] - p[1] * q[0]);  // y down
                }
                EXPECT_NEAR(swept, area / kSectors, 1e-4 * area) << blades << " " << curvature;
            }
        }
}

// As in Cycles: the first corner is at 180/n + rotation, counterclockwise from the right.
TEST(Aperture, CornersStandWhereCyclesPutsThem) {
    const lens::Outline outline({.blades = 5, .rotation_deg = 10});
    for (int i = 0; i < 5; ++i) {
        const auto [x, y] = outline.at(i / 5.0 + 1e-9);
        const double angle = (10 - 36 + 72 * i) * M_PI / 180;
        EXPECT_NEAR(x, std::cos(angle), 1e-4);
        EXPECT_NEAR(y, -std::sin(angle), 1e-4);
    }
}

TEST(Aperture, FullyCurvedBladesAreADisc) {
    EXPECT_EQ(lens::lens_samples({.blades = 5, .curvature = 1}, 40).packed,
              lens::lens_samples({}, 40).packed);
    for (const double angle : {0.0, 0.2, 0.6})
        EXPECT_NEAR(lens::blade_radius(5, 1 - 1e-9, angle), 1, 1e-6);
}

// Whatever was planned before it.
TEST(Aperture, EveryPlanHasThePointsOfItsOwnLens) {
    for (const auto& [blades, samples] : {std::pair{0, 25}, {5, 25}, {5, 40}, {0, 25}}) {
        const Chain chain = chain_of("depth_of_field", {{"samples", int64_t(samples)},
                                                        {"aperture_blades", int64_t(blades)}});
        const Plan plan = must(make_plan(chain, describe_round(deep_planes(64, 48))));
        const auto step = std::ranges::find(plan.steps, "lens_samples", &Step::name);
        ASSERT_NE(step, plan.steps.end());
        shared::LensSamplesUniforms table;
        ASSERT_EQ(step->uniforms.size(), sizeof(table));
        std::memcpy(&table, step->uniforms.data(), sizeof(table));
        const lens::Points points = lens::lens_samples({.blades = blades}, samples);
        ASSERT_EQ(table.points, points.count);
        ASSERT_EQ(table.sets, points.sets);
        for (size_t i = 0; i < points.packed.size(); ++i) {
            const int both = table.packed_points[i / 4][int(i % 4)];
            ASSERT_EQ(int16_t(both & 0xffff), points.packed[i][0]) << blades << " " << i;
            ASSERT_EQ(int16_t(both >> 16), points.packed[i][1]) << blades << " " << i;
        }
    }
}

TEST(Aperture, OwnValuesStandBeforeTheCameras) {
    Camera camera;
    camera.aperture_blades = 5;
    camera.aperture_ratio = 1.5;
    lens::ApertureParameters own;
    own.aperture_blades = 7;
    const Aperture aperture = lens::aperture_of(own, camera);
    EXPECT_EQ(aperture.blades, 7);
    EXPECT_EQ(aperture.ratio, 1.5);
    EXPECT_EQ(aperture.cats_eye, 0);
}

// A triangle with a corner on the right, at -60 + 180/3 degrees, extends twice as far that way; in
// front of the focus it is rotated by half a turn.
TEST(Aperture, BehindTheFocusUprightBeforeItTurned) {
    for (const bool near : {false, true}) {
        // R = 8 for sky, -24 for the near plane.
        const double radius = near ? 24.0 : 8.0;
        const ImageF out =
            dot(near ? 1 : 0, {{"aperture_blades", int64_t(3)}, {"aperture_rotation_deg", -60.0}});
        double farthest[2] = {0, 0};  // to the left, to the right
        for (int x = 0; x < 97; ++x)
            if (out.at(x, 48) > 0) {
                double& reach = farthest[x > 48];
                reach = std::max(reach, std::abs(x - 48.0));
            }
        EXPECT_NEAR(farthest[near ? 0 : 1], radius, 2.5) << near;
        EXPECT_NEAR(farthest[near ? 1 : 0], radius / 2, 1.5) << near;
    }
}

// In the corners the barrel is shifted by all of cats_eye, whatever the shape of the pixels.
TEST(Aperture, TheBarrelCutsTheCornersOfTheDisplay) {
    FrameDescription frame;
    frame.display_width = 640;
    frame.display_height = 360;
    // Corners in shorter sides of a pixel.
    for (const auto& [aspect, x, y] :
         {std::tuple(1.0, 320.0, 180.0), {2.0, 640.0, 180.0}, {0.5, 320.0, 360.0}}) {
        frame.pixel_aspect = aspect;
        const Aperture aperture{.cats_eye = 0.8, .axes = lens::pixel_axes(frame)};
        EXPECT_NEAR(lens::barrel_per_px(aperture, frame) * std::hypot(x, y), 0.8, 1e-12) << aspect;
    }
}

// In a corner the barrel's circle is shifted by all of cats_eye: two circles at distance d share
// the area 2 acos(d/2) - d/2 sqrt(4 - d^2), and no light is lost.
TEST(Aperture, CatsEyeIsTwoCirclesInCommon) {
    constexpr double kNearPx = 24;  // R = 32 (1/4 - 1) px
    const ImageF out = dot(1, {{"cats_eye", 0.8}}, 6400 - 48, 3600 - 48);
    const Moments m = moments_of(out, 48, 48);
    EXPECT_NEAR(m.light, 1, 0.05);
    const double shared = 2 * std::acos(0.4) - 0.4 * std::sqrt(4 - 0.64);
    int lit = 0;
    for (int y = 0; y < 97; ++y)
        for (int x = 0; x < 97; ++x) lit += out.at(x, y) > 0.5 / (shared * kNearPx * kNearPx);
    // A few pixels at the rim receive less than half of their samples.
    EXPECT_NEAR(lit / (shared * kNearPx * kNearPx), 1, 0.06);
    // In front of the focus the remaining area is shifted away from the center, by half of the
    // barrel's shift.
    const double moved = 0.5 * 0.8 * kNearPx;
    EXPECT_NEAR(m.x, moved * 16 / std::hypot(16, 9), 1);
    EXPECT_NEAR(m.y, moved * 9 / std::hypot(16, 9), 1);
    // Pixels twice as high as wide: on the display the corner lies elsewhere.
    const Moments high =
        moments_of(dot(1, {{"cats_eye", 0.8}}, 6400 - 48, 3600 - 48, {}, 0.5), 48, 48);
    EXPECT_NEAR(high.light, 1, 0.05);
    EXPECT_NEAR(high.x, moved * 8 / std::hypot(8, 9), 1);
    EXPECT_NEAR(high.y, moved * 9 / std::hypot(8, 9) / 2, 0.5);
    // In the center nothing is cut.
    const Moments middle = moments_of(dot(1, {{"cats_eye", 0.8}}, 3200 - 48, 1800 - 48), 48, 48);
    EXPECT_NEAR(middle.x, 0, 0.2);
    EXPECT_NEAR(middle.xx, kNearPx * kNearPx / 4, 6);
}

}  // namespace
}  // namespace postchain::test
