// Depth and motion vectors against values derived by hand. F = 50/36 * width pixels per unit slope.
#include <gmock/gmock.h>

#include <cmath>

#include "tests/measure/scenes/support.h"

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

Object wall(PoseAt pose) {
    return unlit(rectangle(9, 9, std::move(pose), {}), {1, 1, 1});
}

TEST(Depth, OfAPlaneAcrossTheAxisIsThePlanarDistanceEverywhere) {
    SceneModel model = empty_model();
    model.objects = {wall(still(at({0, 0, 2.5})))};
    const ScenePlanes planes = render(model, center_sample());
    for (float z : planes.depth.data) EXPECT_NEAR(z, 2.5, 2e-6);
}

TEST(Depth, OfATiltedPlaneFollowsItsEquation) {
    // Points (u cos a, v, 3 - u sin a); slope s = x/z gives u = 3 s / (cos a + s sin a) and
    // z = 3 cos a / (cos a + s sin a).
    SceneModel model = empty_model();
    const double a = 0.6;
    model.objects = {wall(still(at({0, 0, 3}, turn({0, 1, 0}, a))))};
    const ScenePlanes planes = render(model, center_sample());
    for (int x = 0; x < kWidth; ++x) {
        const double s = film_x(x) / kF;
        EXPECT_NEAR(planes.depth.at(x, 7), 3 * std::cos(a) / (std::cos(a) + s * std::sin(a)), 1e-5);
    }
}

TEST(Depth, OfASphereAtItsMiddleIsDistanceLessRadius) {
    SceneModel model = empty_model();
    model.objects = {unlit(sphere(0.25, still(at({0, 0, 2})), {}), {1, 1, 1})};
    RenderSettings settings = center_sample();
    settings.width = settings.height = 1;  // on the axis
    EXPECT_NEAR(render(model, settings).depth.at(0, 0), 1.75, 1e-6);
}

TEST(Depth, OfEachSolidOnTheAxis) {
    struct Case {
        Object object;
        double depth;
    };
    const auto back = still(at({0, 0, 2}));
    // A torus about y has its tube at 2 - (0.3 + 0.05); a rod about z has its round end there.
    const Case cases[] = {
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

TEST(Vectors, OfATranslation) {
    // F v / z = 100 * (0.04, 0.016) / 2 = (2, 0.8) pixels per frame, up.
    SceneModel model = empty_model();
    model.objects = {wall([](double t) { return at({0.04 * t, 0.016 * t, 2}); })};
    const ScenePlanes planes = render(model, center_sample());
    for (int y = 0; y < kHeight; y += 7)
        for (int x = 0; x < kWidth; x += 5) {
            const float* v = planes.vectors.pixel(x, y);
            EXPECT_NEAR(v[0], -2, 1e-4);  // previous - this: it came from the lower left
            EXPECT_NEAR(v[1], -0.8, 1e-4);
            EXPECT_NEAR(v[2], -2, 1e-4);  // this - next
            EXPECT_NEAR(v[3], -0.8, 1e-4);
        }
}

TEST(Vectors, OfAnApproachDifferBetweenThePreviousAndTheNextFrame) {
    // A point seen at x from depth 2 is at x 2/1.9 in the next and at x 2/2.1 in the previous
    // frame.
    SceneModel model = empty_model();
    model.objects = {wall([](double t) { return at({0, 0, 2 - 0.1 * t}); })};
    const ScenePlanes planes = render(model, center_sample());
    for (int x = 0; x < kWidth; x += 5) {
        const float* v = planes.vectors.pixel(x, 3);
        EXPECT_NEAR(v[0], film_x(x) * (2 / 2.1 - 1), 2e-4);
        EXPECT_NEAR(v[1], film_y(3) * (2 / 2.1 - 1), 2e-4);
        EXPECT_NEAR(v[2], film_x(x) * (1 - 2 / 1.9), 2e-4);
        EXPECT_NEAR(v[3], film_y(3) * (1 - 2 / 1.9), 2e-4);
    }
}

TEST(Vectors, OfARotationAreChordsToBothSides) {
    // (x, y) rotates by a: next = (x cos a - y sin a, x sin a + y cos a), previous by -a.
    const double a = 0.3, c = std::cos(a), s = std::sin(a);
    SceneModel model = empty_model();
    model.objects = {wall([a](double t) { return at({0, 0, 2}, turn({0, 0, 1}, a * t)); })};
    RenderSettings settings = center_sample();
    settings.time = 5;
    const ScenePlanes planes = render(model, settings);
    for (int y = 1; y < kHeight; y += 9)
        for (int x = 0; x < kWidth; x += 6) {
            const double px = film_x(x), py = film_y(y);
            const float* v = planes.vectors.pixel(x, y);
            EXPECT_NEAR(v[0], px * c + py * s - px, 3e-4);
            EXPECT_NEAR(v[1], -px * s + py * c - py, 3e-4);
            EXPECT_NEAR(v[2], px - (px * c - py * s), 3e-4);
            EXPECT_NEAR(v[3], py - (px * s + py * c), 3e-4);
        }
}

TEST(Vectors, OfAPanAreThoseOfAProjection) {
    // Direction theta appears at F tan(theta - yaw): if the camera turns right, everything moves
    // left.
    const double a = 0.05;
    SceneModel model = empty_model();
    model.camera = [a](double t) {
        return CameraPose{at({0, 0, 0}, turn({0, 1, 0}, a * t)), 50, 2};
    };
    model.objects = {wall(still(at({0, 0, 4})))};
    const ScenePlanes planes = render(model, center_sample());
    for (int x = 0; x < kWidth; x += 5) {
        const double theta = std::atan(film_x(x) / kF);
        const float* v = planes.vectors.pixel(x, 10);
        EXPECT_NEAR(v[2], film_x(x) - kF * std::tan(theta - a), 3e-4);
        EXPECT_NEAR(v[0], kF * std::tan(theta + a) - film_x(x), 3e-4);
        EXPECT_GT(v[2], 0);
    }
}

TEST(Vectors, OfAZoomFollowTheFocalLength) {
    // x grows with the focal length: next = x * 55/50, previous = x * 45/50.
    SceneModel model = empty_model();
    model.camera = [](double t) { return CameraPose{Pose{}, 50 + 5 * t, 2}; };
    model.objects = {wall(still(at({0, 0, 4})))};
    const ScenePlanes planes = render(model, center_sample());
    for (int x = 0; x < kWidth; x += 5) {
        EXPECT_NEAR(planes.vectors.at(x, 10, 0), -0.1 * film_x(x), 2e-4);
        EXPECT_NEAR(planes.vectors.at(x, 10, 2), -0.1 * film_x(x), 2e-4);
    }
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
    model.background_opaque = true;
    model.camera = [](double t) {
        return CameraPose{at({0, 0, 0}, turn({0, 1, 0}, 0.1 * t)), 50, 2};
    };
    const ScenePlanes planes = render(model, center_sample());
    EXPECT_THAT(planes.depth.data, testing::Each(1e10f));
    EXPECT_THAT(planes.vectors.data, testing::Each(0.0f));
    for (int x = 0; x < kWidth; ++x) {
        EXPECT_EQ(planes.color.at(x, 5, 3), 1);
        EXPECT_GT(planes.color.at(x, 5, 2), 0.1);
    }
}

TEST(Sky, IsNothingWhereTheBackgroundIsTransparent) {
    const ScenePlanes planes = render(empty_model(), center_sample());
    EXPECT_THAT(planes.color.data, testing::Each(0.0f));
    EXPECT_THAT(planes.depth.data, testing::Each(1e10f));
}

}  // namespace
}  // namespace postchain::scenes::test
