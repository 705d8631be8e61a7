// Alpha, light and shadow, sizes.
#include <gmock/gmock.h>

#include <cmath>

#include "tests/scenes/support.h"

namespace postchain::scenes::test {
namespace {

RenderSettings small(int width, int height) {
    RenderSettings settings;
    settings.width = width;
    settings.height = height;
    settings.vectors = true;
    return settings;
}

Object pane(double z, double alpha, glm::dvec3 radiance) {
    Object object = unlit(rectangle(9, 9, still(at({0, 0, z})), {}), radiance);
    object.alpha = alpha;
    return object;
}

TEST(Alpha, OverNothingIsPremultiplied) {
    SceneModel model = empty_model();
    model.objects = {pane(1.5, 0.5, {4, 2, 1})};
    const ScenePlanes planes = render(model, small(3, 3));
    EXPECT_THAT(std::vector<float>(planes.color.pixel(1, 1), planes.color.pixel(1, 1) + 4),
                testing::ElementsAre(2, 1, 0.5, 0.5));
}

TEST(Alpha, MixesWithWhatLiesBehindInDepthOrder) {
    // 0.5 * 4 + 0.5 * (0.25 * 8 + 0.75 * 1) = 3.375; listed back to front.
    SceneModel model = empty_model();
    model.objects = {pane(3, 1, {1, 1, 1}), pane(1.5, 0.5, {4, 4, 4}), pane(2, 0.25, {8, 8, 8})};
    const ScenePlanes planes = render(model, small(3, 3));
    EXPECT_NEAR(planes.color.at(1, 1), 3.375, 1e-6);
    EXPECT_EQ(planes.color.at(1, 1, 3), 1);
}

TEST(Alpha, DepthAndVectorsAreOfTheFirstSurfaceOfAtLeastHalf) {
    SceneModel model = empty_model();
    Object half = pane(1.5, 0.5, {1, 1, 1});
    half.pose = [](double t) { return at({0.3 * t, 0, 1.5}); };
    Object quarter = pane(1.2, 0.25, {1, 1, 1});
    quarter.pose = [](double t) { return at({0, 0.3 * t, 1.2}); };
    model.objects = {quarter, half, pane(3, 1, {1, 1, 1})};
    const ScenePlanes planes = render(model, small(36, 20));  // F = 50
    EXPECT_NEAR(planes.depth.at(9, 9), 1.5, 1e-5);
    EXPECT_NEAR(planes.vectors.at(9, 9, 2), -50 * 0.3 / 1.5, 1e-3);
    EXPECT_EQ(planes.vectors.at(9, 9, 3), 0);
    model.objects[1].alpha = 0.49;
    EXPECT_NEAR(render(model, small(36, 20)).depth.at(9, 9), 3, 1e-5);
}

TEST(Alpha, AHoleInARectangleShowsWhatIsBehind) {
    SceneModel model = empty_model();
    model.objects = {pane(2, 1, {3, 3, 3})};
    model.objects[0].hole = {0.2, 0.1, 0.15, 0};  // F = 100: at (+10, +5) pixels, radius 7.5
    const ScenePlanes planes = render(model, small(72, 40));
    double empty = 0;
    for (int y = 0; y < 40; ++y)
        for (int x = 0; x < 72; ++x) {
            const double dx = x + 0.5 - 36 - 10, dy = 20 - y - 0.5 - 5;
            const double alpha = planes.color.at(x, y, 3);
            ASSERT_GT(std::abs(std::hypot(dx, dy) - 7.5), 1e-3);
            EXPECT_EQ(alpha, std::hypot(dx, dy) < 7.5 ? 0 : 1);
            EXPECT_EQ(planes.depth.at(x, y) > 1e9, alpha == 0);
            empty += 1 - alpha;
        }
    EXPECT_NEAR(empty, 3.14159 * 7.5 * 7.5, 8);
}

TEST(Light, OfALambertianPlaneIsAroundPlusSunTimesTheCosine) {
    // Frontal light on a plane across the axis: albedo * (ambient of a level normal + strength).
    SceneModel model = empty_model();
    model.light = {0, 0, -1};
    model.light_strength = 2;
    model.ambient = {0.3, 0.3, 0.3};
    model.ambient_below = 0.5;  // a normal with y = 0 gets the mean of 1 and 0.5
    model.objects = {rectangle(9, 9, still(at({0, 0, 2})), {0.4, 0.4, 0.4})};
    EXPECT_NEAR(render(model, small(1, 1)).color.at(0, 0), 0.4 * (0.3 * 0.75 + 2), 1e-5);
    // Light at 60 degrees: half of it.
    model.light = {std::sqrt(3.0), 0, -1};
    EXPECT_NEAR(render(model, small(1, 1)).color.at(0, 0), 0.4 * (0.3 * 0.75 + 1), 1e-5);
}

TEST(Light, AShadowFallsWhereTheLightSaysSo) {
    // Light from (0.5, 0, -1): the shadow of the ball at depth 2 is half a unit to the left on the
    // wall at depth 3, (-0.5, 0, 3): with F = 100 at 36 - 16.7 = pixel 19. The ball itself, 5
    // pixels wide, is at 36.
    SceneModel model = empty_model();
    model.light = {0.5, 0, -1};
    model.light_strength = 2;
    model.objects = {rectangle(9, 9, still(at({0, 0, 3})), {0.4, 0.4, 0.4}),
                     sphere(0.1, still(at({0, 0, 2})), {0.4, 0.4, 0.4})};
    const ScenePlanes planes = render(model, small(72, 40));
    const float lit = planes.color.at(60, 20), shade = planes.color.at(19, 20);
    // The wall without sun: albedo * ambient.r * (1 + below) / 2.
    EXPECT_NEAR(shade, 0.4 * model.ambient.r * 0.5 * (1 + model.ambient_below), 1e-5);
    EXPECT_GT(lit, 3 * shade);
    // Across the light, the ball is a disc of radius 0.1: 0.1 high on the wall, 3.3 pixels.
    for (int y : {17, 18, 21, 22}) EXPECT_EQ(planes.color.at(19, y), shade) << y;
    for (int y : {15, 24}) EXPECT_GT(planes.color.at(19, y), 3 * shade) << y;
}

TEST(Sizes, FromOnePixelOnAndAcrossTiles) {
    // A plane with known depth at each pixel shows wrong tiles and lost edges.
    for (auto [width, height] : {std::pair{1, 1}, {1, 7}, {5, 1}, {15, 17}, {16, 16}, {33, 49}}) {
        SceneModel model = empty_model();
        model.objects = {
            unlit(rectangle(99, 99, still(at({0, 0, 2}, turn({1, 0, 0}, 0.4))), {}), {1, 1, 1})};
        const ScenePlanes planes = render(model, small(width, height));
        ASSERT_EQ(planes.color.width, width);
        ASSERT_EQ(planes.color.height, height);
        for (int y = 0; y < height; ++y)
            for (int x = 0; x < width; ++x) {
                // Points (u, v cos a, 2 + v sin a): z = 2 cos a / (cos a - s sin a).
                const double s = (height / 2.0 - y - 0.5) / (50.0 / 36 * width);
                const double expected = 2 * std::cos(0.4) / (std::cos(0.4) - s * std::sin(0.4));
                if (expected < 0) continue;  // one pixel wide and high: above the horizon
                EXPECT_NEAR(planes.depth.at(x, y) / expected, 1, 1e-5);
                EXPECT_EQ(planes.color.at(x, y, 3), 1);
            }
    }
}

TEST(Sizes, OutOfRangeIsAUsageError) {
    for (auto [width, height] : {std::pair{0, 4}, {4, 0}, {16385, 4}, {-1, 4}}) {
        auto planes = renderer().render(empty_model(), small(width, height));
        ASSERT_FALSE(planes.ok());
        EXPECT_EQ(planes.status().code(), StatusCode::usage);
    }
    RenderSettings none = small(4, 4);
    none.samples = 0;
    EXPECT_EQ(renderer().render(empty_model(), none).status().code(), StatusCode::usage);
}

}  // namespace
}  // namespace postchain::scenes::test
