// Culling must never lose a surface: points on the objects of every scene, seen through lens
// points, are in tiles that list their object, and in light cells that do.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "tools/scenes/cull.h"
#include "tools/scenes/scene.h"

namespace postchain::scenes {
namespace {

bool lists(const CellLists& cells, size_t table, int cell, size_t id, Shape shape) {
    const size_t head = table + size_t(cell) * (SCENE_SHAPES + 1) + size_t(shape);
    for (uint32_t i = cells.entry[head]; i < cells.entry[head + 1]; ++i)
        if (cells.entry[i] == id) return true;
    return false;
}

// A surface point in local coordinates, from two numbers in -1..1.
glm::dvec3 surface_point(const Object& object, double a, double b) {
    const double around = 3.14159265 * a, other = 3.14159265 * b;
    const glm::dvec4 size = object.size;
    switch (object.shape) {
        case Shape::rectangle:
            return {a * size.x, b * size.y, 0};
        case Shape::wheel:
            return size.x * glm::dvec3(std::cos(around), std::sin(around), 0) * b;
        case Shape::sphere:
            return size.x * glm::dvec3(std::cos(around) * std::sqrt(1 - b * b),
                                       std::sin(around) * std::sqrt(1 - b * b), b);
        case Shape::box:
            return {a * size.x, b * size.y, a > b ? size.z : -size.z};
        case Shape::rod:
            return {size.y * std::cos(around), b * size.x, size.y * std::sin(around)};
        case Shape::torus: {
            const double radius = size.x + size.y * std::cos(other);
            return {radius * std::cos(around), radius * std::sin(around), size.y * std::sin(other)};
        }
    }
    return {};
}

TEST(Cull, NeverLosesASurface) {
    Random random(1);
    for (const SceneInfo& scene : scenes()) {
        const SceneModel model = scene.make();
        const std::vector<Instant> instants = {instant_of(model, 3.9), instant_of(model, 4.1)};
        const double focus = instants[0].camera.focus_distance;
        const ImageGeometry picture{
            200, 113, *model.lens.sensor_width_mm,
            lens_radius(instants[0].camera.focal_length_mm, *model.lens.f_stop), focus};
        const CellLists cells = cull(model, instants, picture);
        int seen = 0, shaded = 0;
        for (size_t id = 0; id < model.objects.size(); ++id)
            for (int i = 0; i < 60; ++i) {
                const Object& object = model.objects[id];
                const Instant& instant = instants[size_t(i % 2)];
                const glm::dvec3 world = instant.objects[id].to_world(
                    surface_point(object, random.between(-1, 1), random.between(-1, 1)));
                if (object.casts) {
                    const LightGrid& grid = cells.grid;
                    const glm::dvec2 at(
                        (glm::dot(world, grid.right) - grid.first.x) * grid.cells_per_unit.x,
                        (glm::dot(world, grid.up) - grid.first.y) * grid.cells_per_unit.y);
                    ASSERT_TRUE(at.x >= 0 && at.y >= 0 && at.x < SCENE_LIGHT_GRID &&
                                at.y < SCENE_LIGHT_GRID);
                    EXPECT_TRUE(lists(cells, cells.lights, int(at.y) * SCENE_LIGHT_GRID + int(at.x),
                                      id, object.shape))
                        << scene.name << " object " << id;
                    ++shaded;
                }
                const glm::dvec3 p = instant.camera.pose.to_local(world);
                if (p.z <= 0.02) continue;
                // Through lens sample l, the point appears at F (p/z + l (1/s - 1/z)).
                const double angle = random.between(0, 6.283);
                const glm::dvec2 l =
                    picture.lens_radius * glm::dvec2(std::cos(angle), std::sin(angle));
                const glm::dvec2 film = picture.focal_px(instant.camera) *
                                        (glm::dvec2(p) / p.z + l * (1 / focus - 1 / p.z));
                const double x = 100 + film.x, y = 56.5 - film.y;
                if (x < 0 || y < 0 || x >= 200 || y >= 113) continue;
                EXPECT_TRUE(lists(cells, cells.tiles,
                                  int(y) / SCENE_TILE * 13 + int(x) / SCENE_TILE, id, object.shape))
                    << scene.name << " object " << id;
                ++seen;
            }
        EXPECT_GT(seen, 300) << scene.name;
        EXPECT_GT(shaded, 100) << scene.name;
    }
}

TEST(Cull, HoldsForNearSpheresInAWideView) {
    // 12 mm: a half angle of 56 degrees; seen at the side, a sphere extends far beyond r/z.
    Random random(2);
    SceneModel model;
    model.camera = [](double) { return CameraPose{Pose{}, 12, 1}; };
    for (int i = 0; i < 150; ++i) {
        const double z = random.between(0.5, 2), radius = z * random.between(0.1, 0.6);
        const glm::dvec3 center(random.between(-1.2, 1.2) * z, random.between(-0.6, 0.6) * z, z);
        model.objects.push_back(sphere(radius, still(at(center)), {1, 1, 1}));
    }
    const ImageGeometry picture{320, 160, 36, 0, 1};
    const CellLists cells = cull(model, {instant_of(model, 0)}, picture);
    for (size_t id = 0; id < model.objects.size(); ++id)
        for (int i = 0; i < 200; ++i) {
            const Object& object = model.objects[id];
            const glm::dvec3 p = object.pose(0).to_world(
                surface_point(object, random.between(-1, 1), random.between(-1, 1)));
            const double x = 160 + 320 * 12 / 36.0 * p.x / p.z;
            const double y = 80 - 320 * 12 / 36.0 * p.y / p.z;
            if (p.z <= 0.02 || x < 0 || y < 0 || x >= 320 || y >= 160) continue;
            EXPECT_TRUE(
                lists(cells, cells.tiles, int(y) / 16 * 20 + int(x) / 16, id, Shape::sphere))
                << id << " at " << x << " " << y;
        }
}

TEST(Cull, LeavesOutWhatIsFarFromATile) {
    SceneModel model;
    model.camera = [](double) { return CameraPose{}; };
    // Depth 2, F = 160/36*50 = 222: 1 pixel of radius in the image center.
    model.objects = {sphere(0.009, still(at({0, 0, 2})), {1, 1, 1}),
                     sphere(0.009, still(at({0, 0, -2})), {1, 1, 1})};
    const CellLists cells = cull(model, {instant_of(model, 0)}, {160, 160, 36, 0, 1});
    int listed = 0;
    for (int tile = 0; tile < 100; ++tile) {
        listed += lists(cells, cells.tiles, tile, 0, Shape::sphere);
        EXPECT_FALSE(lists(cells, cells.tiles, tile, 1, Shape::sphere)) << "behind the camera";
    }
    EXPECT_EQ(listed, 4);  // the center is a corner of four tiles
}

TEST(Samples, FillEachPairEvenly) {
    for (bool lens : {false, true}) {
        const auto points = sample_points(256, lens);
        for (int first : {0, 2}) {
            std::array<int, 256> boxes{};
            glm::dvec2 mean(0);
            for (const glm::vec4& p : points) {
                const glm::dvec2 pair(p[first], p[first + 1]);
                ASSERT_TRUE(pair.x >= 0 && pair.x < 1 && pair.y >= 0 && pair.y < 1);
                ++boxes[size_t(pair.x * 16) * 16 + size_t(pair.y * 16)];
                mean += pair / 256.0;
            }
            const auto empty = std::count(boxes.begin(), boxes.end(), 0);
            // 16 x 16 boxes: the Sobol pair has one point in each; random points leave 94 empty.
            const bool sobol = lens == (first == 0);
            EXPECT_LE(empty, sobol ? 0 : 64);
            EXPECT_NEAR(mean.x, 0.5, sobol ? 1e-6 : 0.01);
            EXPECT_NEAR(mean.y, 0.5, sobol ? 1e-6 : 0.01);
        }
        EXPECT_EQ(sample_points(1, lens)[0], glm::vec4(0.5f)) << "one sample is the center";
    }
}

}  // namespace
}  // namespace postchain::scenes
