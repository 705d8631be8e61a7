// Findings and repairs of depth and motion when a frame is read: sky, edges, borders before a clear
// background.
#include <gtest/gtest.h>

#include <cmath>

#include "chain/frame/behind.h"
#include "tools/sequence/source/camera_motion.h"
#include "tools/sequence/source/reduced_frame.h"
#include "tools/sequence/source/surface_edges.h"

namespace postchain::sequence::surfaces_test {
namespace {

constexpr int kWidth = 40, kHeight = 20;
constexpr double kFocalPx = 50.0 * kWidth / 36.0;
constexpr Display kDisplay = {kWidth, kHeight, 1};

// About the camera's x (looks up), y (looks to the left) or z axis.
Rotation turned(int axis, double angle) {
    Rotation r = {{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
    const size_t i = size_t(axis + 1) % 3, j = size_t(axis + 2) % 3;
    r[i][i] = r[j][j] = std::cos(angle);
    r[i][j] = -std::sin(angle);
    r[j][i] = std::sin(angle);
    return r;
}

// A camera that turns by `angle` per frame, known in these frames.
CameraFile turning(int axis, double angle, const std::vector<int>& frames) {
    CameraFile file;
    file.camera.focal_length_mm = 50;
    file.camera.sensor_width_mm = 36;
    for (int frame : frames) file.rotations[frame] = turned(axis, angle * frame);
    return file;
}

std::optional<SkyViews> views_of(const CameraFile& file, const std::set<int>& cuts = {}) {
    return sky_views(
        &file, [](int) { return std::nullopt; }, 5, kDisplay, cuts);
}

// Sky above a surface that moves by (3, 0); the left column is clear.
struct Sky {
    FramePlanes planes;
    FrameDescription frame;
    Sky() {
        ImageF color(kWidth, kHeight, 4, 1.0f), depth(kWidth, kHeight, 1, 1e-10f);
        ImageF motion(kWidth, kHeight, 2);
        for (int x = 0; x < kWidth; ++x)
            for (int y = 0; y < kHeight; ++y) {
                if (x == 0)
                    for (int c = 0; c < 4; ++c) color.at(x, y, c) = 0;
                if (y < kHeight - 3) continue;
                depth.at(x, y) = 0.5f;
                motion.at(x, y, 0) = 3;
            }
        planes = {{Role::color, color},
                  {Role::inverse_depth, depth},
                  {Role::motion, motion},
                  {Role::motion_back, motion}};
        frame.width = frame.display_width = kWidth;
        frame.height = frame.display_height = kHeight;
        frame.bounds.max_speed_px = frame.bounds.max_speed_back_px = 3;
    }
    double motion(Role role, int x, int y, int c) const {
        return double(planes.at(role).at(x, y, c));
    }
};

Sky filled(const CameraFile& file, const std::set<int>& cuts = {}) {
    Sky sky;
    EXPECT_EQ(fill_sky_motion(views_of(file, cuts).value(), sky.planes, sky.frame),
              uint64_t((kWidth - 1) * (kHeight - 3)));
    return sky;
}

TEST(SkyMotion, FollowsAPan) {
    const double angle = 0.1;
    const Sky sky = filled(turning(1, angle, {4, 5, 6}));
    // If the camera turns left, the sky moves right.
    for (int x : {1, 20, 39}) {
        const double at = x + 0.5 - kWidth / 2.0, direction = std::atan(at / kFocalPx);
        EXPECT_NEAR(sky.motion(Role::motion, x, 9, 0), kFocalPx * std::tan(direction + angle) - at,
                    1e-4);
        EXPECT_NEAR(sky.motion(Role::motion_back, x, 9, 0),
                    at - kFocalPx * std::tan(direction - angle), 1e-4);
    }
    EXPECT_EQ(sky.motion(Role::motion, 0, 9, 0), 0);   // clear
    EXPECT_EQ(sky.motion(Role::motion, 9, 19, 0), 3);  // has a vector
    EXPECT_NEAR(sky.frame.bounds.max_speed_px,
                std::hypot(sky.motion(Role::motion, 39, 0, 0), sky.motion(Role::motion, 39, 0, 1)),
                1e-5);
}

TEST(SkyMotion, FollowsTiltAndRoll) {
    const Sky up = filled(turning(0, 0.05, {4, 5, 6}));
    EXPECT_NEAR(up.motion(Role::motion, 20, 9, 1), kFocalPx * std::tan(0.05), 0.1);  // down
    // About the center: if the camera rolls left, the image rolls right.
    const Sky rolled = filled(turning(2, 0.05, {4, 5, 6}));
    EXPECT_NEAR(rolled.motion(Role::motion, 39, 9, 0),
                19.5 * (std::cos(0.05) - 1) + 0.5 * std::sin(0.05), 1e-4);
    EXPECT_NEAR(rolled.motion(Role::motion, 39, 9, 1),
                19.5 * std::sin(0.05) - 0.5 * (std::cos(0.05) - 1), 1e-4);
}

TEST(SkyMotion, TurnsOnEvenlyWhereAFrameIsMissingOrCut) {
    const Sky all = filled(turning(1, 0.1, {4, 5, 6}));
    const std::pair<std::vector<int>, std::set<int>> cases[] = {
        {{5, 6}, {}}, {{4, 5}, {}}, {{4, 5, 6}, {4}}, {{4, 5, 6}, {5}}};
    for (const auto& [frames, cuts] : cases) {
        const Sky sky = filled(turning(1, 0.1, frames), cuts);
        for (Role role : {Role::motion, Role::motion_back})
            EXPECT_NEAR(sky.motion(role, 30, 5, 0), all.motion(role, 30, 5, 0), 1e-4);
    }
    EXPECT_FALSE(views_of(turning(1, 0, {4, 5, 6}))->turns());  // static
}

TEST(SkyMotion, WithoutMatricesItIsCountedWhereAllElseMoves) {
    Sky sky;
    EXPECT_EQ(count_sky(sky.planes).without_motion(), uint64_t((kWidth - 1) * (kHeight - 3)));
    for (int x = 0; x < kWidth / 2; ++x) sky.planes.at(Role::motion).at(x, kHeight - 1, 0) = 0;
    EXPECT_EQ(count_sky(sky.planes).without_motion(), 0u);
}

// A surface at 1 that moves by (8, 0) before a static one at 4, with a slanted border. `samples`
// per axis and pixel, over which depth or motion is averaged.
FramePlanes two_surfaces(int depth_samples, int motion_samples) {
    ImageF depth(64, 48, 1), motion(64, 48, 2);
    const auto covered = [](int x, int y, int samples) {
        double sum = 0;
        for (int j = 0; j < samples; ++j)
            for (int i = 0; i < samples; ++i)
                sum += (y + (j + 0.5) / samples) > 8 + 0.37 * (x + (i + 0.5) / samples);
        return sum / (samples * samples);
    };
    for (int y = 0; y < 48; ++y)
        for (int x = 0; x < 64; ++x) {
            const double near = covered(x, y, depth_samples);
            depth.at(x, y) = float(near + 0.25 * (1 - near));
            motion.at(x, y, 0) = float(8 * covered(x, y, motion_samples));
        }
    return {{Role::inverse_depth, depth}, {Role::motion, motion}};
}

MixedEdges mixed_edges(const FramePlanes& planes) {
    return count_mixed_edges(planes).parts();
}

TEST(MixedEdges, TellsAveragesFromSamples) {
    const MixedEdges hard = mixed_edges(two_surfaces(1, 1));
    EXPECT_EQ(hard.depth, 0);
    EXPECT_EQ(hard.motion, 0);
    const MixedEdges motion = mixed_edges(two_surfaces(1, 8));
    EXPECT_EQ(motion.depth, 0);
    EXPECT_GT(motion.motion, 0.3);
    EXPECT_GT(mixed_edges(two_surfaces(8, 8)).depth, 0.3);
}

// A step in depth along either axis, with a row or column of mixed values, and the largest slope
// beside it that is none of a surface.
TEST(MixedEdges, AlongEitherAxis) {
    for (const bool rows : {false, true})
        for (const double mixed : {1.0, 0.5}) {
            ImageF depth(48, 48, 1), motion(48, 48, 2);
            for (int y = 0; y < 48; ++y)
                for (int x = 0; x < 48; ++x) {
                    const int at = rows ? y : x;  // rows 2, 6, 10, ... are looked at
                    const double near = at < 22 ? 0 : at == 22 ? mixed : 1;
                    depth.at(x, y) = float(0.25 + 0.75 * near);
                    motion.at(x, y, rows) = float(8 * near);
                }
            const MixedEdgeCounts found =
                count_mixed_edges({{Role::inverse_depth, depth}, {Role::motion, motion}});
            // Both pixels of a clean step have neighbors that differ, the row of one pixel in four.
            const uint64_t pixels = rows ? 44 : 11 * (mixed == 1 ? 2 : 1);
            for (const auto& count : {found.depth, found.motion}) {
                EXPECT_EQ(count.edges, pixels) << rows << mixed;
                EXPECT_EQ(count.mixed, mixed == 1 ? 0 : pixels) << rows << mixed;
            }
        }
}

TEST(MixedEdges, SlopesAreNoEdges) {
    ImageF depth(64, 48, 1), motion(64, 48, 2);
    for (int y = 0; y < 48; ++y)
        for (int x = 0; x < 64; ++x) {
            depth.at(x, y) = float(0.1 + 0.02 * y);
            motion.at(x, y, 0) = float(2 * x);
        }
    const MixedEdges found = mixed_edges({{Role::inverse_depth, depth}, {Role::motion, motion}});
    EXPECT_EQ(found.depth, 0);
    EXPECT_EQ(found.motion, 0);
}

// A square of 8x8 pixels at distance 2 that moves by (5, 1), with a ring of partly covered pixels
// that have the depth of the clear background.
struct Square {
    FramePlanes planes;
    Square() {
        ImageF color(24, 20, 4), depth(24, 20, 1, 1e-10f), motion(24, 20, 2), back(24, 20, 2);
        for (int y = 5; y < 15; ++y)
            for (int x = 5; x < 15; ++x) {
                const bool inside = x > 5 && y > 5 && x < 14 && y < 14;
                for (int c = 0; c < 4; ++c) color.at(x, y, c) = inside ? 1 : 0.3f;
                if (!inside) continue;
                depth.at(x, y) = 0.5f;
                motion.at(x, y, 0) = back.at(x, y, 0) = 5;
                motion.at(x, y, 1) = 1;
            }
        planes = {{Role::color, color},
                  {Role::inverse_depth, depth},
                  {Role::motion, motion},
                  {Role::motion_back, back}};
    }
};

TEST(ClearEdges, BelongToTheSurfaceBesideThem) {
    Square square;
    EXPECT_EQ(fill_clear_edges(square.planes), 36u);
    for (int y = 0; y < 20; ++y) {
        for (int x = 0; x < 24; ++x) {
            const bool covered = x >= 5 && y >= 5 && x < 15 && y < 15;
            const auto at = [&](Role role, int c) { return square.planes.at(role).at(x, y, c); };
            EXPECT_EQ(at(Role::inverse_depth, 0), covered ? 0.5f : 1e-10f) << x << "," << y;
            EXPECT_EQ(at(Role::motion, 0), covered ? 5 : 0);
            EXPECT_EQ(at(Role::motion, 1), covered ? 1 : 0);
            EXPECT_EQ(at(Role::motion_back, 0), covered ? 5 : 0);
        }
    }
}

TEST(ClearEdges, LeaveWhatIsOpaqueOrFarFromAnySurface) {
    Square sky;
    for (size_t i = 0; i < sky.planes.at(Role::color).pixels(); ++i)
        sky.planes.at(Role::color).data[4 * i + 3] = 1;
    EXPECT_EQ(fill_clear_edges(sky.planes), 0u);
    // A pane of cloud, 4 pixels from the square.
    Square cloud;
    cloud.planes.at(Role::color).at(18, 10, 3) = 0.5f;
    EXPECT_EQ(fill_clear_edges(cloud.planes), 36u);
    EXPECT_EQ(cloud.planes.at(Role::inverse_depth).at(18, 10), 1e-10f);
}

// Depths of a reduced frame are never mixed.
TEST(Reduced, DepthIsThatOfTheMiddle) {
    ImageF depth(5, 1, 1);
    depth.data = {1, 3, 5, 7, 9};
    EXPECT_EQ(middle_reduced(depth, 1, 1).data, (std::vector<float>{5}));
    EXPECT_EQ(middle_reduced(depth, 2, 1).data, (std::vector<float>{3, 7}));
    std::swap(depth.width, depth.height);
    EXPECT_EQ(middle_reduced(depth, 1, 1).data, (std::vector<float>{5}));
    EXPECT_EQ(middle_reduced(depth, 1, 2).data, (std::vector<float>{3, 7}));
}

// A frame of 10x7 pixels within one of 40x30, at a place that is not that of its corner.
TEST(Reduced, EveryLengthIsInItsPixels) {
    SourceFrame source;
    FrameDescription& frame = source.description;
    frame.width = 10;
    frame.height = 7;
    frame.display_width = 40;
    frame.display_height = 30;
    frame.origin_x = 12;
    frame.origin_y = -9;
    frame.bounds.color_is_half = true;
    source.planes = shared({{Role::color, ImageF(10, 7, 4, 1)}});
    reduce_frame(source, 0.25);
    EXPECT_EQ(std::pair(frame.width, frame.height), std::pair(3, 2));
    EXPECT_EQ(std::pair(frame.display_width, frame.display_height), std::pair(10, 8));
    EXPECT_EQ(std::pair(frame.origin_x, frame.origin_y), std::pair(3, -2));
    EXPECT_FALSE(frame.bounds.color_is_half) << "a mean of halves is none";
    EXPECT_EQ(*source.planes.at(Role::color), ImageF(3, 2, 4, 1));
}

// Motion is in pixels of the smaller frame. Its width is halved, its height is 4/7.
TEST(Reduced, MotionIsInItsPixels) {
    SourceFrame source;
    source.description.width = source.description.display_width = 10;
    source.description.height = source.description.display_height = 7;
    source.description.bounds.max_speed_px = source.description.bounds.max_speed_back_px = 14;
    ImageF motion(10, 7, 2), behind(10, kBehindPlanes * 7, 4, 14);
    for (size_t i = 0; i < motion.pixels(); ++i) {
        motion.data[2 * i] = 10;
        motion.data[2 * i + 1] = 14;
    }
    source.planes = shared({{Role::motion, motion},
                            {Role::motion_back, motion},
                            {Role::motion_after, motion},
                            {Role::behind, behind}});
    reduce_frame(source, 0.5);
    EXPECT_EQ(source.description.width, 5);
    EXPECT_EQ(source.description.height, 4);
    EXPECT_FLOAT_EQ(float(source.description.bounds.max_speed_px), 8);
    EXPECT_FLOAT_EQ(float(source.description.bounds.max_speed_back_px), 8);
    for (const Role role : {Role::motion, Role::motion_back, Role::motion_after}) {
        EXPECT_FLOAT_EQ(source.planes.at(role)->at(4, 3, 0), 5) << name_of(role);
        EXPECT_FLOAT_EQ(source.planes.at(role)->at(4, 3, 1), 8) << name_of(role);
    }
    // Its color, its inverse depth, and its motion forward and backward.
    const ImageF& reduced = *source.planes.at(Role::behind);
    for (int c = 0; c < 4; ++c) {
        EXPECT_FLOAT_EQ(reduced.at(4, 3, c), 14);
        EXPECT_FLOAT_EQ(reduced.at(4, 7, c), 14);
        EXPECT_FLOAT_EQ(reduced.at(4, 11, c), c % 2 == 0 ? 7 : 8);
    }
}

// Between two surfaces at the same distance, the one with more coverage wins.
TEST(ClearEdges, BelongToWhatCoversMore) {
    ImageF color(3, 1, 4, 0.5f), depth(3, 1, 1);
    color.at(0, 0, 3) = 0.6f;
    color.at(2, 0, 3) = 0.9f;
    depth.at(0, 0) = 1;
    depth.at(2, 0) = 0.25f;
    FramePlanes planes = {{Role::color, color}, {Role::inverse_depth, depth}};
    EXPECT_EQ(fill_clear_edges(planes), 1u);
    EXPECT_EQ(planes.at(Role::inverse_depth).at(1, 0), 0.25f);
}

}  // namespace
}  // namespace postchain::sequence::surfaces_test
