// Properties of each scene (docs/scenes.md).
#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>

#include "tests/scenes/support.h"
#include "tests/support/status.h"

namespace postchain::scenes::test {
namespace {

double speed(const ScenePlanes& planes, int x, int y) {
    const float* v = planes.vectors.pixel(x, y);
    return std::hypot(v[2], v[3]);
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

struct Range {
    double low, high;
};

// The depths and speeds that docs/scenes.md describes; shares are parts of all pixels.
TEST(Scenes, HaveTheDepthsAndSpeedsOfTheirDescriptions) {
    struct Row {
        const char* name;
        int width, height;
        Range nearest, fastest, sky, still, in_focus, fast;
    };
    const Range any = {0, 1e9}, none = {0, 0};
    const Row rows[] = {
        // 0.42 rad per frame at 0.116 of depth 0.8 - tilt: 444 px/unit * 0.116/0.78 * 2 sin(0.21).
        {"wheels", 320, 180, {0.5, 0.85}, {26.5, 28.5}, none, any, {0.01, 1}, any},
        {"poles", 640, 90, {0, 1.7}, any, {0.02, 0.9}, {0.0035, 0.1}, any, {0.35, 1}},
        {"crossing", 640, 360, any, {60, 110}, any, any, any, {0.02, 0.5}},  // 88 plus the rotation
        {"crossing", 320, 180, any, {30, 55}, any, any, any, any},
        {"zoom", 320, 180, any, {10, 30}, {0.05, 0.9}, any, any, any},
        {"still", 160, 90, {0.5, 0.8}, none, {0.01, 0.9}, {0.1, 1}, any, none}};
    for (const Row& row : rows) {
        const ScenePlanes planes = render(row.name, row.width, row.height, 1, Picture::gbuf);
        SceneRequest request;
        request.name = row.name;
        const Camera camera = camera_at(postchain::test::must(model_for(request)), 1);
        double nearest = 1e10, fastest = 0, sky = 0, still = 0, in_focus = 0, fast = 0;
        for (int y = 0; y < row.height; ++y)
            for (int x = 0; x < row.width; ++x) {
                const double z = planes.depth.at(x, y), v = speed(planes, x, y);
                nearest = std::min(nearest, z);
                fastest = std::max(fastest, v);
                in_focus += v > 1 && std::abs(z - *camera.focus_distance) < 0.06;
                fast += v > 39;
                if (z > 1e9) {
                    ++sky;
                    EXPECT_EQ(v, 0);
                } else
                    still += v < 1e-3;
            }
        const double pixels = double(planes.depth.pixels());
        const std::tuple<const char*, Range, double> found[] = {
            {"nearest", row.nearest, nearest},
            {"fastest", row.fastest, fastest},
            {"sky", row.sky, sky / pixels},
            {"still", row.still, still / pixels},
            {"in focus", row.in_focus, in_focus / pixels},
            {"fast", row.fast, fast / pixels}};
        for (const auto& [what, range, value] : found)
            EXPECT_TRUE(range.low <= value && value <= range.high)
                << row.name << " " << what << ": " << value;
    }
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
    for (int frame = 0; frame < 100; ++frame) {
        const ImageF vectors = render("crossing", 64, 36, frame, Picture::gbuf).vectors;
        for (size_t i = 0; i < vectors.data.size(); i += 2)
            ASSERT_LT(std::hypot(vectors.data[i], vectors.data[i + 1]), 11) << frame;
    }
}

TEST(Zoom, MovesAwayFromTheMiddle) {
    const ScenePlanes planes = render("zoom", 320, 180, 1, Picture::gbuf);
    for (int y = 0; y < 180; ++y)
        for (int x = 0; x < 320; ++x) {
            const float* v = planes.vectors.pixel(x, y);
            if (planes.depth.at(x, y) > 1e9) continue;
            // Along the ray from the center: parallel and outward.
            const double px = x + 0.5 - 160, py = 90 - y - 0.5;
            const double along = -(px * v[2] + py * v[3]), cross = px * v[3] - py * v[2];
            ASSERT_TRUE(along > 0 && std::abs(cross) < 1e-3 * along + 1e-3) << x << "," << y;
        }
    const SceneModel model = postchain::test::must(model_for({.name = "zoom"}));
    EXPECT_GT(*camera_at(model, 2).focal_length_mm, *camera_at(model, 1).focal_length_mm);
    EXPECT_LT(*camera_at(model, 2).focus_distance, *camera_at(model, 1).focus_distance);
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

// RMS difference of the color, as displayed.
double display_rmse(const ImageF& a, const ImageF& b) {
    const auto display = [](float value) { return std::pow(value / (1 + value), 1 / 2.2); };
    double sum = 0;
    for (size_t i = 0; i < a.data.size(); ++i)
        if (i % 4 < 3) sum += std::pow(display(a.data[i]) - display(b.data[i]), 2);
    return std::sqrt(sum / double(3 * a.pixels()));
}

TEST(Sharp, IsTheMeanOverThePixel) {
    // An image of eight times the size, averaged: a box filter.
    const ScenePlanes sharp = render("still", 64, 36, 1, Picture::sharp, 256);
    const ScenePlanes fine = render("still", 512, 288, 1, Picture::gbuf);
    ImageF mean(64, 36, 4);
    for (int y = 0; y < 288; ++y)
        for (int x = 0; x < 512; ++x)
            for (int c = 0; c < 4; ++c) mean.at(x / 8, y / 8, c) += fine.color.at(x, y, c) / 64;
    EXPECT_LT(display_rmse(mean, sharp.color), 0.012);
}

TEST(Truth, ConvergesWithTheNumberOfSamples) {
    const ScenePlanes best = render("wheels", 40, 23, 3, Picture::both, 1024);
    std::vector<double> errors;
    for (int samples : {4, 16, 64, 256})
        errors.push_back(
            display_rmse(render("wheels", 40, 23, 3, Picture::both, samples).color, best.color));
    // Random samples would end at an eighth. The first steps look better than they are, because
    // highlights saturate on display and a few samples miss them.
    for (size_t i = 1; i < errors.size(); ++i) EXPECT_LT(errors[i], 0.75 * errors[i - 1]) << i;
    EXPECT_LT(errors.back(), errors.front() / 5);
    EXPECT_LT(errors.back(), 0.02);
}

}  // namespace
}  // namespace postchain::scenes::test
