// Properties of each scene (docs/scenes.md), and the vector convention by reprojection.
#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>

#include "tests/measure/scenes/support.h"
#include "tools/measure/scenes/wheels.h"
#include "tools/measure/scenes/zoom.h"

namespace postchain::scenes::test {
namespace {

double speed(const ScenePlanes& planes, int x, int y) {
    const float* v = planes.vectors.pixel(x, y);
    return std::hypot(v[2], v[3]);
}

double largest_speed(const ScenePlanes& planes) {
    double largest = 0;
    for (int y = 0; y < planes.depth.height; ++y)
        for (int x = 0; x < planes.depth.width; ++x)
            largest = std::max(largest, speed(planes, x, y));
    return largest;
}

TEST(Scenes, AreTheFiveOfTheCommand) {
    std::vector<std::string> names;
    for (const SceneInfo& scene : scenes()) names.push_back(scene.name);
    EXPECT_THAT(names, testing::ElementsAre("wheels", "poles", "crossing", "zoom", "still"));
}

TEST(Scenes, HaveHighlightsAndFinitePlanes) {
    for (const SceneInfo& scene : scenes())
        for (int frame : {-7, 1001}) {
            const ScenePlanes planes = render(scene.name, 101, 67, frame, Picture::gbuf);
            float brightest = 0;
            for (float value : planes.color.data) {
                ASSERT_TRUE(std::isfinite(value) && value >= 0);
                brightest = std::max(brightest, value);
            }
            EXPECT_GT(brightest, 8) << scene.name;
            EXPECT_LT(brightest, 65504) << scene.name << ": fits half";
            for (float z : planes.depth.data) ASSERT_TRUE(z > 0.05f && (z < 100 || z == 1e10f));
            for (float v : planes.vectors.data) ASSERT_TRUE(std::isfinite(v) && std::abs(v) < 200);
        }
}

// Mean difference between frame n and its reprojection from frame n+1 by the motion vectors, over
// moving pixels. `next`: use ZW (otherwise XY); signs multiply the displacement in image rows (y
// down).
double warp_error(const ScenePlanes& a, const ScenePlanes& b, bool next, int sx, int sy) {
    double sum = 0;
    int count = 0;
    for (int y = 0; y < a.depth.height; ++y)
        for (int x = 0; x < a.depth.width; ++x) {
            if (speed(a, x, y) < 2) continue;
            const float* v = a.vectors.pixel(x, y) + (next ? 2 : 0);
            const int to_x = int(std::floor(x + 0.5 + sx * v[0]));
            const int to_y = int(std::floor(y + 0.5 + sy * v[1]));
            if (!b.depth.inside(to_x, to_y)) continue;
            for (int c = 0; c < 3; ++c)
                sum += std::abs(display(a.color.at(x, y, c)) - display(b.color.at(to_x, to_y, c)));
            ++count;
        }
    EXPECT_GT(count, 200);
    return sum / (3 * count);
}

TEST(Vectors, LeadFromEachFrameToTheNext) {
    // frame.md: motion = (-Z, +W) in rows from the top. Of all eight combinations, it must be
    // clearly better than the wrong signs, and than XY if motion is curved.
    for (const char* name : {"wheels", "poles", "crossing", "zoom"}) {
        const ScenePlanes a = render(name, 320, 180, 4, Picture::gbuf);
        const ScenePlanes b = render(name, 320, 180, 5, Picture::gbuf);
        const double right = warp_error(a, b, true, -1, +1);
        for (bool next : {true, false})
            for (int sx : {-1, 1})
                for (int sy : {-1, 1}) {
                    if (next && sx == -1 && sy == 1) continue;
                    const double wrong = warp_error(a, b, next, sx, sy);
                    const bool only_xy = !next && sx == -1 && sy == 1;
                    // A pan has almost no vertical motion, so its sign has little effect.
                    const bool flat = std::string(name) == "poles" && sx == -1;
                    EXPECT_GT(wrong, (only_xy || flat ? 1.0 : 1.25) * right)
                        << name << " next " << next << " signs " << sx << sy;
                }
        EXPECT_LT(right, 0.12) << name;
    }
}

TEST(Vectors, LeadBackToThePreviousFrame) {
    // XY = position(previous) - position(this): in rows from the top, at (+X, -Y).
    for (const char* name : {"wheels", "zoom"}) {
        const ScenePlanes a = render(name, 320, 180, 5, Picture::gbuf);
        const ScenePlanes b = render(name, 320, 180, 4, Picture::gbuf);
        EXPECT_LT(warp_error(a, b, false, +1, -1), 0.8 * warp_error(a, b, false, -1, +1)) << name;
        EXPECT_LT(warp_error(a, b, false, +1, -1), 0.12) << name;
    }
}

TEST(Vectors, FindTheSameSurfaceInTheNextFrame) {
    // Only the camera moves in zoom: a point at depth z has depth z - (one frame's drive) in the
    // next frame at its reprojected position. Exceptions: occluded points and edges.
    const ScenePlanes a = render("zoom", 320, 180, 2, Picture::gbuf);
    const ScenePlanes b = render("zoom", 320, 180, 3, Picture::gbuf);
    const SceneModel model = make_zoom();
    const double drive = model.camera(3).pose.position.z - model.camera(2).pose.position.z;
    EXPECT_GT(drive, 0.1);
    int inside = 0, same = 0;
    for (int y = 0; y < 180; ++y)
        for (int x = 0; x < 320; ++x) {
            const float z = a.depth.at(x, y);
            if (z > 12) continue;  // the ground's depth changes too much per pixel there
            const float* v = a.vectors.pixel(x, y);
            const int to_x = int(std::floor(x + 0.5 - v[2])),
                      to_y = int(std::floor(y + 0.5 + v[3]));
            if (!b.depth.inside(to_x, to_y)) continue;
            ++inside;
            same += std::abs(b.depth.at(to_x, to_y) - (z - drive)) < 0.02 * z;
        }
    EXPECT_GT(inside, 25000);
    EXPECT_GT(same, 0.95 * inside);
}

TEST(Wheels, ThreeDepthsWithTheGreenOneInFocusAndCurvedMotion) {
    const ScenePlanes planes = render("wheels", 320, 180, 1, Picture::gbuf);
    const Camera camera = camera_at(make_wheels(), 1);
    // A surface belongs to the wheel whose color dominates.
    double near_red = 1e9, near_blue = 1e9, curved = 0;
    int green_in_focus = 0, red = 0, green = 0, blue = 0;
    for (int y = 0; y < 180; ++y)
        for (int x = 0; x < 320; ++x) {
            if (speed(planes, x, y) < 1) continue;
            const float* c = planes.color.pixel(x, y);
            const double z = planes.depth.at(x, y);
            const float* v = planes.vectors.pixel(x, y);
            curved = std::max<double>(
                curved, std::hypot(v[0] - v[2], v[1] - v[3]) / 2 / std::hypot(v[2], v[3]));
            if (c[0] > 4 * c[1] && c[0] > 4 * c[2]) ++red, near_red = std::min(near_red, z);
            if (c[2] > 4 * c[0] && c[2] > 3 * c[1]) ++blue, near_blue = std::min(near_blue, z);
            if (c[1] > 4 * c[0] && c[1] > 4 * c[2])
                ++green, green_in_focus += std::abs(z - *camera.focus_distance) < 0.06;
        }
    EXPECT_GT(red, 500);
    EXPECT_GT(green, 500);
    EXPECT_GT(blue, 500);
    EXPECT_GT(green_in_focus, 0.95 * green);
    EXPECT_LT(near_red, 0.85);
    EXPECT_GT(near_blue, 2.0);
    EXPECT_GT(curved, 0.15);  // half of |XY - ZW| over |v| = tan(angle / 2) = 0.21 for 0.42 rad
    // 0.42 rad per frame at 0.116 of depth 0.8 - tilt: 444 px/unit * 0.116/0.78 * 2 sin(0.21).
    EXPECT_NEAR(largest_speed(planes), 27.5, 1.0);
}

TEST(Poles, RidersStandStillBeforeAFastPanUnderASky) {
    const ScenePlanes planes = render("poles", 640, 90, 0, Picture::gbuf);
    int sky = 0, still_near = 0, fast = 0;
    for (int y = 0; y < 90; ++y)
        for (int x = 0; x < 640; ++x) {
            const double z = planes.depth.at(x, y);
            if (z > 1e9) {
                ++sky;
                EXPECT_EQ(speed(planes, x, y), 0);
            } else if (speed(planes, x, y) < 1e-3) {
                ++still_near;
                EXPECT_LT(z, 1.7);
            } else if (speed(planes, x, y) > 39) {
                ++fast;
            }
        }
    EXPECT_GT(sky, 1000);
    EXPECT_GT(still_near, 200);
    EXPECT_GT(fast, 20000);
}

TEST(Crossing, SpeedsScaleWithTheWidthAndGoAllWays) {
    const ScenePlanes wide = render("crossing", 640, 360, 1, Picture::gbuf);
    const double largest = largest_speed(wide);
    EXPECT_GT(largest, 60);
    EXPECT_LT(largest, 110);  // 88 plus the rotation's part
    const double half = largest_speed(render("crossing", 320, 180, 1, Picture::gbuf));
    EXPECT_NEAR(half / largest, 0.5, 0.02);
    int octants[8] = {};
    for (int y = 0; y < 360; ++y)
        for (int x = 0; x < 640; ++x) {
            const float* v = wide.vectors.pixel(x, y);
            if (std::hypot(v[2], v[3]) > 5)
                ++octants[int((std::atan2(-v[3], -v[2]) + 3.14159265) / (6.2831854 / 8)) % 8];
        }
    for (int count : octants) EXPECT_GT(count, 300);
}

TEST(Crossing, HasAHalfTransparentPaneAndAHoleWithoutAlpha) {
    const ScenePlanes planes = render("crossing", 320, 180, 1, Picture::gbuf);
    const auto count = [&](double alpha) {
        int pixels = 0;
        for (size_t i = 3; i < planes.color.data.size(); i += 4)
            pixels += planes.color.data[i] == float(alpha);
        return pixels;
    };
    EXPECT_GT(count(0), 300);
    EXPECT_GT(count(0.5), 100);  // the pane before the hole
    for (int y = 0; y < 180; ++y)
        for (int x = 0; x < 320; ++x)
            if (planes.color.at(x, y, 3) == 0) {
                EXPECT_EQ(planes.color.at(x, y, 0), 0);
                EXPECT_EQ(planes.depth.at(x, y), 1e10f);
            }
}

TEST(Crossing, NobodyJumpsInSight) {
    // The jump back is longer than any image: no vector of 100 frames includes it.
    for (int frame = 0; frame < 100; ++frame)
        ASSERT_LT(largest_speed(render("crossing", 64, 36, frame, Picture::gbuf)), 11) << frame;
}

TEST(Zoom, MovesAwayFromTheMiddle) {
    const ScenePlanes planes = render("zoom", 320, 180, 1, Picture::gbuf);
    int sky = 0, away = 0, moving = 0;
    for (int y = 0; y < 180; ++y)
        for (int x = 0; x < 320; ++x) {
            const float* v = planes.vectors.pixel(x, y);
            if (planes.depth.at(x, y) > 1e9) {
                ++sky;
                EXPECT_EQ(speed(planes, x, y), 0);
                continue;
            }
            const double px = x + 0.5 - 160, py = 90 - y - 0.5;
            ++moving;
            // Along the ray from the center: parallel and outward.
            const double along = -(px * v[2] + py * v[3]), cross = px * v[3] - py * v[2];
            away += along > 0 && std::abs(cross) < 1e-3 * along + 1e-3;
        }
    EXPECT_GT(sky, 3000);
    EXPECT_EQ(away, moving);
    EXPECT_GT(largest_speed(planes), 10);
    const SceneModel model = make_zoom();
    EXPECT_GT(*camera_at(model, 2).focal_length_mm, *camera_at(model, 1).focal_length_mm);
    EXPECT_LT(*camera_at(model, 2).focus_distance, *camera_at(model, 1).focus_distance);
}

TEST(Still, HasExactlyNoMotionAndTheSamePictureInEveryFrame) {
    const ScenePlanes planes = render("still", 160, 90, 1, Picture::gbuf);
    EXPECT_THAT(planes.vectors.data, testing::Each(0.0f));
    EXPECT_EQ(render("still", 160, 90, 50, Picture::gbuf).color, planes.color);
    const auto [low, high] =
        std::minmax_element(planes.depth.data.begin(), planes.depth.data.end());
    EXPECT_LT(*low, 0.8f);
    EXPECT_EQ(*high, 1e10f);
}

// A ball before a wall: without the ball that pixels show, but with its shadow.
TEST(Behind, ShowsWhatTheObjectOfEachPixelHides) {
    SceneModel model = empty_model(2, 1e6);
    model.light = {-0.15, 0.1, -0.7};
    model.objects.push_back(rectangle(4, 4, still(at({0, 0, 4})), {0.7, 0.6, 0.5}));
    model.objects.push_back(sphere(0.3, still(at({0, 0, 3})), {0.1, 0.2, 0.9}));
    RenderSettings settings;
    settings.width = 96;
    settings.height = 64;
    settings.vectors = true;
    const ScenePlanes front = render(model, settings);
    settings.behind = true;
    const ScenePlanes behind = render(model, settings);
    model.objects[1].pose = still(at({0, 0, -90}));
    settings.behind = false;
    const ScenePlanes wall = render(model, settings);
    int hidden = 0, shadowed = 0;
    for (int y = 0; y < 64; ++y)
        for (int x = 0; x < 96; ++x) {
            if (front.depth.at(x, y) > 3.5f) {
                EXPECT_EQ(behind.depth.at(x, y), 1e10f);  // nothing is behind the wall
                continue;
            }
            ++hidden;
            EXPECT_EQ(behind.depth.at(x, y), wall.depth.at(x, y));
            EXPECT_LE(behind.color.at(x, y, 2), wall.color.at(x, y, 2));
            shadowed += behind.color.at(x, y, 2) < 0.9f * wall.color.at(x, y, 2);
        }
    EXPECT_GT(hidden, 200);
    EXPECT_GT(shadowed, 20);
}

TEST(Sharp, HasTheDepthOfTheCenterAndMeanVectors) {
    const ScenePlanes gbuf = render("wheels", 160, 90, 2, Picture::gbuf);
    const ScenePlanes sharp = render("wheels", 160, 90, 2, Picture::sharp, 16);
    EXPECT_EQ(gbuf.depth, sharp.depth);
    // At silhouettes the mean is between a wheel's vector and the wall's.
    int between = 0;
    for (int y = 0; y < 90; ++y)
        for (int x = 0; x < 160; ++x) between += speed(gbuf, x, y) == 0 && speed(sharp, x, y) > 0.5;
    EXPECT_GT(between, 50);
}

TEST(Sharp, IsTheMeanOverThePixel) {
    // Sixteen one-sample images of four times the size, averaged: a box filter.
    const ScenePlanes sharp = render("still", 64, 36, 1, Picture::sharp, 256);
    const ScenePlanes fine = render("still", 512, 288, 1, Picture::gbuf);
    ImageF mean(64, 36, 4);
    for (int y = 0; y < 288; ++y)
        for (int x = 0; x < 512; ++x)
            for (int c = 0; c < 4; ++c) mean.at(x / 8, y / 8, c) += fine.color.at(x, y, c) / 64;
    EXPECT_LT(display_rmse(mean, sharp.color), 0.012);
}

}  // namespace
}  // namespace postchain::scenes::test
