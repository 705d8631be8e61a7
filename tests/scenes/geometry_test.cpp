// Depth and motion vectors against values derived by hand. F = 50/36 * width pixels per unit slope.
#include <gmock/gmock.h>

#include <array>
#include <cmath>

#include "tests/scenes/support.h"

namespace postchain::scenes::test {
namespace {

constexpr int kWidth = 72, kHeight = 40;
constexpr double kF = 100;  // 50 / 36 * 72

RenderSettings center_sample() {
    RenderSettings settings;
    settings.width = kWidth;
    settings.height = kHeight;
    settings.vectors = true;
    return settings;
}

// Image coordinates of a pixel center: +x right, +y up, from the image center.
double film_x(int x) {
    return x + 0.5 - kWidth / 2.0;
}
double film_y(int y) {
    return kHeight / 2.0 - y - 0.5;
}

// A pixel's motion vectors: from the previous frame, and to the next.
using Motion = std::array<double, 4>;
// expected(x, y), from image coordinates.
template <class F>
void expect_vectors(const SceneModel& model, const F& expected, double time = 0) {
    RenderSettings settings = center_sample();
    settings.time = time;
    const ScenePlanes planes = render(model, settings);
    for (int y = 1; y < kHeight; y += 9)
        for (int x = 0; x < kWidth; x += 5) {
            const Motion wanted = expected(film_x(x), film_y(y));
            for (int c = 0; c < 4; ++c)
                EXPECT_NEAR(planes.vectors.at(x, y, c), wanted[size_t(c)], 3e-4)
                    << x << "," << y << " " << c;
        }
}

TEST(Depth, OfEachSolidOnTheAxis) {
    struct Case {
        Object object;
        double depth;
    };
    const auto back = still(at({0, 0, 2}));
    // A torus about y has its tube at 2 - (0.3 + 0.05); a rod about z has its round end there.
    const Case cases[] = {
        {rectangle(9, 9, back, {}), 2},
        {sphere(0.25, back, {}), 1.75},
        {box({0.1, 0.2, 0.3}, back, {}), 1.7},
        {rod(0.4, 0.1, back, {}), 1.9},
        {rod(0.4, 0.1, still(at({0, 0, 2}, turn({1, 0, 0}, std::acos(0.0)))), {}), 1.5},
        {torus(0.3, 0.05, still(at({0, 0, 2}, turn({1, 0, 0}, std::acos(0.0)))), {}), 1.65},
        {torus(0.3, 0.05, still(at({0.3, 0, 2})), {}), 1.95},
    };
    for (const Case& c : cases) {
        SceneModel model = empty_model();
        model.objects = {unlit(c.object, {1, 1, 1})};
        RenderSettings settings = center_sample();
        settings.width = settings.height = 1;
        EXPECT_NEAR(render(model, settings).depth.at(0, 0), c.depth, 2e-5)
            << "shape " << int(c.object.shape);
    }
}

TEST(Depth, OfAWheelsGapsIsThatOfTheGround) {
    SceneModel model = empty_model();
    Object wheel;
    wheel.shape = Shape::wheel;
    wheel.size = {0.3, 0.05, 8, 0.01};
    wheel.pose = still(at({0, 0, 1}));
    model.objects = {unlit(wheel, {1, 1, 1}), wall(still(at({0, 0, 3})))};
    const ScenePlanes planes = render(model, center_sample());
    const int cx = kWidth / 2, cy = kHeight / 2;
    EXPECT_NEAR(planes.depth.at(cx, cy), 1, 1e-5);  // hub
    // A spoke is in the middle of each of the 8 sectors: one at 22.5 degrees, none at 0.
    EXPECT_NEAR(planes.depth.at(cx + 14, cy - 6), 1, 1e-5);
    EXPECT_NEAR(planes.depth.at(cx + 15, cy), 3, 1e-5);
}

TEST(Vectors, OfAnApproachDifferBetweenThePreviousAndTheNextFrame) {
    // A point at depth 2 that is seen at x is at x 2/1.9 in the next and x 2/2.1 in the previous
    // frame.
    SceneModel model = empty_model();
    model.objects = {wall([](double t) { return at({0, 0, 2 - 0.1 * t}); })};
    expect_vectors(model, [](double x, double y) {
        return Motion{x * (2 / 2.1 - 1), y * (2 / 2.1 - 1), x * (1 - 2 / 1.9), y * (1 - 2 / 1.9)};
    });
}

TEST(Vectors, OfARotationAreChordsToBothSides) {
    // (x, y) rotates by a: next = (x cos a - y sin a, x sin a + y cos a), previous by -a.
    const double a = 0.3, c = std::cos(a), s = std::sin(a);
    SceneModel model = empty_model();
    model.objects = {wall([a](double t) { return at({0, 0, 2}, turn({0, 0, 1}, a * t)); })};
    expect_vectors(
        model,
        [=](double x, double y) {
            return Motion{x * c + y * s - x, -x * s + y * c - y, x - (x * c - y * s),
                          y - (x * s + y * c)};
        },
        5);
}

TEST(Vectors, OfAPanAreThoseOfAProjection) {
    // Direction (theta, y) appears at F tan(theta - yaw), y cos theta / cos(theta - yaw): if the
    // camera turns right, everything moves left.
    const double a = 0.05;
    SceneModel model = empty_model();
    model.camera = [a](double t) {
        return CameraPose{at({0, 0, 0}, turn({0, 1, 0}, a * t)), 50, 2};
    };
    model.objects = {wall(still(at({0, 0, 4})))};
    expect_vectors(model, [=](double x, double y) {
        const double theta = std::atan(x / kF);
        const auto seen = [&](double yaw) {
            return std::array{kF * std::tan(theta - yaw),
                              y * std::cos(theta) / std::cos(theta - yaw)};
        };
        const auto before = seen(-a), after = seen(a);
        EXPECT_GT(x - after[0], 0);
        return Motion{before[0] - x, before[1] - y, x - after[0], y - after[1]};
    });
}

TEST(Vectors, OfAZoomFollowTheFocalLength) {
    // x grows with the focal length: next = x * 55/50, previous = x * 45/50.
    SceneModel model = empty_model();
    model.camera = [](double t) { return CameraPose{Pose{}, 50 + 5 * t, 2}; };
    model.objects = {wall(still(at({0, 0, 4})))};
    expect_vectors(model, [](double x, double y) {
        return Motion{-0.1 * x, -0.1 * y, -0.1 * x, -0.1 * y};
    });
}

TEST(Vectors, AreZeroForWhatTheCameraCannotSeeInTheOtherFrame) {
    // At depth 1 now, behind the camera in the next frame.
    SceneModel model = empty_model();
    model.objects = {wall([](double t) { return at({0, 0, 1 - 1.5 * t}); })};
    const ScenePlanes planes = render(model, center_sample());
    const float* v = planes.vectors.pixel(3, 3);
    EXPECT_EQ(v[2], 0);
    EXPECT_EQ(v[3], 0);
    EXPECT_NEAR(v[0], film_x(3) * (1 / 2.5 - 1), 1e-3);
}

TEST(Sky, HasTheSentinelDepthAndNoVectorsUnderAPan) {
    SceneModel model = empty_model();
    model.camera = [](double t) {
        return CameraPose{at({0, 0, 0}, turn({0, 1, 0}, 0.1 * t)), 50, 2};
    };
    for (const bool opaque : {false, true}) {
        model.background_opaque = opaque;
        const ScenePlanes planes = render(model, center_sample());
        EXPECT_THAT(planes.depth.data, testing::Each(1e10f));
        EXPECT_THAT(planes.vectors.data, testing::Each(0.0f));
        for (int x = 0; x < kWidth; ++x) {
            EXPECT_EQ(planes.color.at(x, 5, 3), opaque ? 1 : 0);
            EXPECT_EQ(planes.color.at(x, 5, 2) > 0.1, opaque);
        }
    }
}

}  // namespace
}  // namespace postchain::scenes::test
