// Motion vectors from depth and camera matrices against closed forms, and the limits of depth of
// field against thin-lens formulas.
#include <gtest/gtest.h>

#include <cmath>

#include "passes/common/circle_of_confusion.h"
#include "passes/common/shutter.h"
#include "tools/sequence/source/camera_motion.h"

namespace postchain::sequence {
namespace {

constexpr int kWidth = 32, kHeight = 18;
constexpr double kFocal = 40;  // pixels
constexpr double kDistance = 4;
const Rotation kStraight = {{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};

struct Scene {
    FramePlanes planes;
    FrameDescription frame;
    Scene() {
        planes = {{Role::color, ImageF(kWidth, kHeight, 4, 1.0f)},
                  {Role::inverse_depth, ImageF(kWidth, kHeight, 1, float(1 / kDistance))},
                  {Role::motion, ImageF(kWidth, kHeight, 2, 7.0f)},  // of the file: replaced
                  {Role::motion_back, ImageF(kWidth, kHeight, 2, 7.0f)}};
        frame.width = frame.display_width = kWidth;
        frame.height = frame.display_height = kHeight;
    }
    explicit Scene(const SkyViews& views) : Scene() {
        moved = set_camera_motion(views, planes, frame);
    }
    uint64_t moved = 0;  // pixels
    double at(Role role, int x, int y, int c) const { return double(planes.at(role).at(x, y, c)); }
};

SkyView view(std::array<double, 3> place, const Rotation& turn = kStraight, double focal = kFocal) {
    return {turn, focal, place};
}

double from_middle_x(int x) {
    return x + 0.5 - kWidth / 2.0;
}
double from_middle_y(int y) {
    return y + 0.5 - kHeight / 2.0;
}

TEST(CameraMotion, ATravelToTheRightMovesNearThingsLeft) {
    Scene scene;
    scene.planes.at(Role::inverse_depth).at(3, 3) = 0;  // the sky
    const SkyViews views = {view({0, 0, 0}), view({-0.1, 0, 0}), view({0.1, 0.2, 0}), 1};
    EXPECT_EQ(set_camera_motion(views, scene.planes, scene.frame), uint64_t(kWidth * kHeight));
    EXPECT_NEAR(scene.at(Role::motion, 9, 5, 0), -kFocal * 0.1 / kDistance, 1e-5);
    EXPECT_NEAR(scene.at(Role::motion, 9, 5, 1), kFocal * 0.2 / kDistance, 1e-5);  // y down
    EXPECT_NEAR(scene.at(Role::motion_back, 9, 5, 0), -kFocal * 0.1 / kDistance, 1e-5);
    EXPECT_NEAR(scene.at(Role::motion_back, 9, 5, 1), 0, 1e-5);
    EXPECT_EQ(scene.at(Role::motion, 3, 3, 0), 0);
    EXPECT_NEAR(scene.frame.bounds.max_speed_px, kFocal / kDistance * std::hypot(0.1, 0.2), 1e-4);
}

TEST(CameraMotion, ForwardZoomRollAndPixelAspect) {
    const Scene dolly({view({0, 0, 0}), view({0, 0, 0}), view({0, 0, -1}), 1});
    // Everything is magnified by 4 / 3.
    EXPECT_NEAR(dolly.at(Role::motion, 30, 2, 0), from_middle_x(30) / 3, 1e-5);
    EXPECT_NEAR(dolly.at(Role::motion, 30, 2, 1), from_middle_y(2) / 3, 1e-5);
    const Scene zoom(
        {view({0, 0, 0}), view({0, 0, 0}), view({0, 0, 0}, kStraight, 1.5 * kFocal), 1});
    EXPECT_NEAR(zoom.at(Role::motion, 30, 2, 0), from_middle_x(30) / 2, 1e-5);
    EXPECT_NEAR(zoom.at(Role::motion_back, 30, 2, 0), 0, 1e-5);
    // The camera rolls left by a, so the image rolls right; with pixels twice as wide as high, one
    // pixel to the right is two down.
    const double a = 0.2, aspect = 2;
    const Rotation rolled = {
        {{std::cos(a), -std::sin(a), 0}, {std::sin(a), std::cos(a), 0}, {0, 0, 1}}};
    const Scene roll({view({5, 6, 7}), view({5, 6, 7}), view({5, 6, 7}, rolled), aspect});
    const double x = from_middle_x(25), y = from_middle_y(4) / aspect;  // in pixel widths
    EXPECT_NEAR(roll.at(Role::motion, 25, 4, 0), x * std::cos(a) - y * std::sin(a) - x, 1e-4);
    EXPECT_NEAR(roll.at(Role::motion, 25, 4, 1), aspect * (x * std::sin(a) + y * std::cos(a) - y),
                1e-4);
}

TEST(CameraMotion, WhatComesToLieBehindTheCameraGetsNone) {
    Scene scene;
    scene.planes.erase(Role::motion_back);
    EXPECT_EQ(set_camera_motion({view({0, 0, 0}), view({0, 0, 0}), view({0, 0, -5}), 1},
                                scene.planes, scene.frame),
              0u);
    EXPECT_EQ(scene.at(Role::motion, 1, 1, 0), 0);
    // Each side separately: a meter closer in each frame, from 5 meters to 4.
    const Scene both({view({0, 0, 0}), view({0, 0, 1}), view({0, 0, -5}), 1});
    EXPECT_EQ(both.at(Role::motion, 1, 1, 0), 0);
    EXPECT_NEAR(both.at(Role::motion_back, 1, 1, 0), from_middle_x(1) / 5, 1e-5);
    const Scene other({view({0, 0, 0}), view({0, 0, -5}), view({0, 0, 1}), 1});
    EXPECT_EQ(other.at(Role::motion_back, 1, 1, 0), 0);
    EXPECT_NEAR(other.at(Role::motion, 1, 1, 0), -from_middle_x(1) / 5, 1e-5);
}

io::CameraMetadata standing(double x, double z = 0) {
    io::CameraMetadata metadata;
    metadata.pose = io::CameraPose{kStraight, {x, 0, z}, 1.25};
    return metadata;
}

TEST(CameraMotion, NeedsAMatrixOfTheFrameAndOfOneBesideIt) {
    const Display display = {kWidth, kHeight, 1};
    const auto views = [&](std::set<int> frames, std::set<int> cuts = {}) {
        return sky_views(
            nullptr,
            [=](int frame) {
                return frames.contains(frame) ? std::optional(standing(0.1 * frame)) : std::nullopt;
            },
            5, display, cuts);
    };
    EXPECT_FALSE(views({5}));
    EXPECT_FALSE(views({4, 6}));
    EXPECT_FALSE(views({4, 5, 6}, {4, 5}));
    for (const std::set<int>& frames : {std::set{4, 5}, std::set{5, 6}, std::set{4, 5, 6}}) {
        const auto found = views(frames);
        ASSERT_TRUE(found && found->have_positions());
        EXPECT_FALSE(found->turns());
        const Scene scene(*found);
        for (Role role : {Role::motion, Role::motion_back})
            EXPECT_NEAR(scene.at(role, 8, 8, 0), -1.25 * kWidth * 0.1 / kDistance, 1e-4);
    }
}

TEST(CameraMotion, AZoomOnEitherSideTurnsTheView) {
    const SkyView still = view({0, 0, 0}), closer = view({0, 0, 0}, kStraight, 1.5 * kFocal);
    EXPECT_FALSE((SkyViews{still, still, still}.turns()));
    EXPECT_TRUE((SkyViews{still, closer, still}.turns()));
    EXPECT_TRUE((SkyViews{still, still, closer}.turns()));
}

TEST(CameraMotion, ViewsNeedAFocalLengthAndVectorsOfSurfacesAPosition) {
    const Display display = {kWidth, kHeight, 1};
    const auto views = [&](const std::string& lens, bool in_file, const char* fourth) {
        const std::string matrices = concat(
            R"(, "camera_matrix_world": {"4": [[1,0,0,9], [0,1,0,9], [0,0,1,9]],
               "5": [[1,0,0,9], [0,1,0,9], [0,0,1,9]], "6": [[1,0,0)",
            fourth, "], [0,1,0", fourth, "], [0,0,1", fourth, "]]}}");
        const CameraFile file = parse_camera("{" + lens + (in_file ? matrices : "}"), "c");
        return sky_views(&file,
                         [&](int frame) {
                             io::CameraMetadata metadata = standing(frame);
                             metadata.pose->focal_widths.reset();
                             if (in_file || frame == 4) metadata.pose.reset();
                             return metadata;
                         },
                         5, display, {});
    };
    const std::string focal = R"("focal_length_mm": 45)",
                      both = focal + R"(, "sensor_width_mm": 36)";
    for (const bool in_file : {true, false}) {
        for (const std::string& lens : {std::string(), focal})
            EXPECT_FALSE(views(lens, in_file, ""));
        ASSERT_TRUE(views(both, in_file, ", 9"));
        EXPECT_EQ(views(both, in_file, ", 9")->now.focal_px, 1.25 * kWidth);
        EXPECT_EQ(views(both, in_file, ", 9")->knows_before, in_file);
        EXPECT_TRUE(views(both, in_file, ", 9")->have_positions());
    }
    EXPECT_FALSE(views(both, true, "")->have_positions());
}

// Infinitely far, still, and with any light or coverage.
TEST(CameraMotion, SkyIsWhatIsNotClear) {
    FramePlanes planes = {{Role::color, ImageF(6, 1, 4)},
                          {Role::inverse_depth, ImageF(6, 1, 1)},
                          {Role::motion, ImageF(6, 1, 2)}};
    for (int i = 0; i < 4; ++i) planes.at(Role::color).at(i, 0, i) = 0.5f;
    planes.at(Role::color).at(5, 0, 3) = 1;
    planes.at(Role::motion).at(5, 0, 1) = 3;
    EXPECT_EQ(count_sky(planes).sky, 4u);
}

// Back by 9 units per frame: a point at distance 4 shrinks to 4/13. Extrapolated, the camera of the
// missing previous frame would have it behind.
TEST(CameraMotion, TheSideThatIsKnownCounts) {
    const Display display = {kWidth, kHeight, 1};
    for (const bool first : {true, false}) {
        const auto views = sky_views(nullptr,
                                     [&](int frame) -> std::optional<io::CameraMetadata> {
                                         if (frame == 5) return standing(0);
                                         if (frame == (first ? 6 : 4)) return standing(0, 9);
                                         return std::nullopt;
                                     },
                                     5, display, {});
        const Scene scene(views.value());
        EXPECT_EQ(scene.moved, uint64_t(kWidth * kHeight));
        const double shrinks = (first ? 1 : -1) * (4.0 / 13 - 1);
        for (Role role : {Role::motion, Role::motion_back}) {
            EXPECT_NEAR(scene.at(role, 30, 2, 0), from_middle_x(30) * shrinks, 1e-4) << first;
            EXPECT_NEAR(scene.at(role, 30, 2, 1), from_middle_y(2) * shrinks, 1e-4) << first;
        }
        EXPECT_NEAR(scene.frame.bounds.max_speed_px,
                    std::hypot(from_middle_x(0), from_middle_y(0)) * std::abs(shrinks), 1e-4);
    }
}

// A renderer that keeps the focal length of the frame gives the vectors of a camera without zoom.
TEST(CameraMotion, AddedZoomGivesTheVectorsOfACameraThatZooms) {
    const double a = 0.05;
    const Rotation turned = {
        {{std::cos(a), 0, std::sin(a)}, {0, 1, 0}, {-std::sin(a), 0, std::cos(a)}}};
    const Zoom zoom = {0.75, 1.25};
    const auto views = [&](double before, double after) {
        return SkyViews{view({0, 0, 0}), view({-0.1, 0, 0.3}, turned, before * kFocal),
                        view({0.1, 0.2, -0.2}, turned, after * kFocal), 2};
    };
    Scene fixed(views(1, 1));
    const Scene zooming(views(zoom.before, zoom.after));
    EXPECT_GT(std::abs(zooming.at(Role::motion, 30, 2, 0) - fixed.at(Role::motion, 30, 2, 0)), 1);
    EXPECT_EQ(add_zoom_motion(zoom, false, fixed.planes, fixed.frame), uint64_t(kWidth * kHeight));
    for (Role role : {Role::motion, Role::motion_back})
        for (size_t i = 0; i < fixed.planes.at(role).data.size(); ++i)
            ASSERT_NEAR(fixed.planes.at(role).data[i], zooming.planes.at(role).data[i], 1e-4)
                << name_of(role) << " " << i;
    EXPECT_NEAR(fixed.frame.bounds.max_speed_px, zooming.frame.bounds.max_speed_px, 1e-4);
    EXPECT_NEAR(fixed.frame.bounds.max_speed_back_px, zooming.frame.bounds.max_speed_back_px, 1e-4);
}

TEST(CameraMotion, AddedZoomLeavesSkyToItsMatrices) {
    Scene scene;
    scene.planes.at(Role::inverse_depth).at(3, 3) = 0;
    for (Role role : {Role::motion, Role::motion_back})
        for (int c = 0; c < 2; ++c) scene.planes.at(role).at(3, 3, c) = 0;
    EXPECT_EQ(add_zoom_motion({1, 2}, true, scene.planes, scene.frame),
              uint64_t(kWidth * kHeight - 1));
    EXPECT_EQ(scene.at(Role::motion, 3, 3, 0), 0);
    EXPECT_EQ(add_zoom_motion({1, 2}, false, scene.planes, scene.frame),
              uint64_t(kWidth * kHeight));
    EXPECT_NEAR(scene.at(Role::motion, 3, 3, 0), from_middle_x(3), 1e-5);
}

TEST(CameraMotion, ZoomNeedsAFocalLengthOfTheFrameAndOfOneBesideIt) {
    const CameraFile file = parse_camera(
        R"({"sensor_width_mm": 36, "focal_length_mm": 30, "frames": {"5": {"focal_length_mm": 40},
            "6": {"focal_length_mm": 50}, "7": {"focal_length_mm": 50}}})",
        "camera.json");
    ASSERT_TRUE(file.status().ok());
    const Display display = {600, 800, 1};
    const auto zoom = [&](int frame, std::set<int> cuts = {}) {
        return zoom_of(file, {}, frame, display, cuts);
    };
    EXPECT_FALSE(zoom(4));
    ASSERT_TRUE(zoom(5) && zoom(6));
    EXPECT_DOUBLE_EQ(zoom(5)->after, 1.25);
    EXPECT_DOUBLE_EQ(zoom(5)->before, 0.8);  // extrapolated
    EXPECT_DOUBLE_EQ(zoom(6)->before, 0.8);
    EXPECT_DOUBLE_EQ(zoom(6)->after, 1);
    EXPECT_FALSE(zoom(7));  // still on the side that is known
    EXPECT_FALSE(zoom_of(parse_camera(R"({"frames": {"5": {"focal_length_mm": 40}}})", "c"), {}, 5,
                         display, {}));
    const auto later =
        zoom_of(parse_camera(R"({"sensor_width_mm": 36, "frames": {"4": {"focal_length_mm": 40},
            "5": {"focal_length_mm": 40}, "6": {"focal_length_mm": 50}}})",
                             "c"),
                {}, 5, display, {});
    ASSERT_TRUE(later);
    EXPECT_EQ(later->before, 1);
    EXPECT_DOUBLE_EQ(later->after, 1.25);
    EXPECT_FALSE(zoom(5, {5}));
    EXPECT_FALSE(zoom(6, {5}));
    EXPECT_FALSE(zoom_of(parse_camera(R"({"focal_length_mm": 30, "sensor_width_mm": 36})", "c"), {},
                         5, display, {}));
}

double value_of(const std::vector<UsedValue>& values, const std::string& key) {
    for (const auto& one : values)
        if (one.key == key)
            return one.value == ParameterValue() ? INFINITY : std::get<double>(one.value);
    ADD_FAILURE() << key;
    return NAN;
}

TEST(UsedValues, LimitsOfSharpnessAreThoseOfAThinLens) {
    FrameDescription frame;
    frame.width = frame.display_width = 1920;
    frame.height = frame.display_height = 1080;
    frame.camera.focal_length_mm = 50;
    frame.camera.sensor_width_mm = 36;
    frame.camera.f_stop = 2.8;
    frame.camera.focus_distance = 400;
    frame.camera.meters_per_unit = 0.01;
    frame.bounds.min_inverse_depth = 0;
    frame.bounds.max_inverse_depth = 1 / 200.0;
    lens::Parameters parameters;
    parameters.breathing = true;
    parameters.max_radius_px = 1000;
    const auto used = [&] {
        return lens::used_values(parameters, *lens::circle_of_confusion(parameters, frame), frame,
                                 0.5);
    };
    const auto values = used();
    // Millimeters; a circle of one pixel on the sensor.
    const double f = 50, s = 4000, blur = 2.8 * 36 / 1920 * (s - f);
    EXPECT_NEAR(value_of(values, "sharp_from"), s * f * f / (f * f + blur) / 10, 1e-6);
    EXPECT_NEAR(value_of(values, "sharp_to"), s * f * f / (f * f - blur) / 10, 1e-6);
    // At 2 m the circle is f^2 (s - d) / (N (s - f) d), larger than at infinity.
    const double d = 2000, circle = f * f * (s - d) / (2.8 * (s - f) * d);
    EXPECT_NEAR(value_of(values, "largest_circle_px"), circle * 1920 / 36, 1e-6);
    // As without a limit.
    parameters.max_radius_px = 3;
    EXPECT_EQ(value_of(used(), "largest_circle_px"), value_of(values, "largest_circle_px"));
    parameters.max_radius_px = 1000;
    // Beyond the hyperfocal distance everything is sharp to infinity.
    frame.camera.f_stop = 64;
    EXPECT_EQ(value_of(used(), "sharp_to"), INFINITY);
}

TEST(UsedValues, LongestStreak) {
    FrameDescription frame;
    frame.camera.shutter_frames = 0.5;
    frame.planes = {Role::color, Role::motion, Role::motion_back};
    frame.bounds.max_speed_px = 30;
    frame.bounds.max_speed_back_px = 36;
    const auto streak = [&](const shutter::Parameters& parameters) {
        return value_of(shutter::used_values(parameters, frame), "longest_streak_px");
    };
    EXPECT_EQ(streak({}), 18);
    EXPECT_EQ(streak({.shutter_frames = {}, .shutter_angle_deg = 90}), 9);
    // A limit changes no record of the longest; the part beyond it is said to be clamped.
    EXPECT_TRUE(shutter::exceeded_limits({}, frame, 9).empty());
    const std::vector<ExceededLimit> limits = shutter::exceeded_limits({}, frame, 5);
    ASSERT_EQ(limits.size(), 1u);
    EXPECT_EQ(limits[0].limit_px, 5);
    EXPECT_EQ(limits[0].largest_px, 9);
    EXPECT_EQ(limits[0].high, 20);  // px per frame
    EXPECT_EQ(limits[0].what, "half-length of a streak");
    // A shutter that opens at the frame draws the whole streak on one side of the pixel.
    FrameDescription at_start = frame;
    at_start.camera.shutter_position = ShutterPosition::start;
    const std::vector<ExceededLimit> one_sided = shutter::exceeded_limits({}, at_start, 9);
    ASSERT_EQ(one_sided.size(), 1u);
    EXPECT_EQ(one_sided[0].largest_px, 18);
    EXPECT_EQ(one_sided[0].what, "length of a streak");
    frame.bounds.camera_cut = true;
    EXPECT_EQ(streak({}), 0);
    EXPECT_TRUE(shutter::exceeded_limits({}, frame, 5).empty());
}

}  // namespace
}  // namespace postchain::sequence
