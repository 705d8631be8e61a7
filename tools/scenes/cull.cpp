#include "tools/scenes/cull.h"

#include <algorithm>
#include <cmath>

namespace postchain::scenes {
namespace {

struct TileRange {
    int x0, y0, x1, y1;  // inclusive; empty if x0 > x1 or y0 > y1
};

// Tiles of a sphere in camera coordinates. For a point p of it, |p.x/p.z - c.x/c.z| <= r/(z-r) (1 +
// |c.x|/z).
TileRange tiles_of(glm::dvec3 c, double r, double focal_px, const ImageGeometry& picture) {
    const int last_x = (picture.width - 1) / SCENE_TILE, last_y = (picture.height - 1) / SCENE_TILE;
    const double near = c.z - r, far = c.z + r;
    if (far <= 0) return {0, 0, -1, -1};
    if (near <= 1e-2) return {0, 0, last_x, last_y};
    const auto blur = [&](double z) {
        return picture.lens_radius * focal_px * std::abs(1 / picture.focus_distance - 1 / z);
    };
    const double pad = std::max(blur(near), blur(far)) + 0.51;
    const double reach_x = focal_px * r / near * (1 + std::abs(c.x) / c.z) + pad;
    const double reach_y = focal_px * r / near * (1 + std::abs(c.y) / c.z) + pad;
    const double x = 0.5 * picture.width + focal_px * c.x / c.z;
    const double y = 0.5 * picture.height - focal_px * c.y / c.z;
    const auto tile = [](double at, int last) {
        return int(std::clamp(std::floor(at / SCENE_TILE), -1.0, double(last + 1)));
    };
    return {std::max(0, tile(x - reach_x, last_x)), std::max(0, tile(y - reach_y, last_y)),
            std::min(last_x, tile(x + reach_x, last_x)),
            std::min(last_y, tile(y + reach_y, last_y))};
}

class SeenTable {
  public:
    SeenTable(int columns, int rows, size_t objects)
        : columns_(columns),
          objects_(objects),
          cells_(size_t(columns) * size_t(rows)),
          seen_(cells_ * objects) {}

    void add(size_t id, const TileRange& range) {
        for (int y = range.y0; y <= range.y1; ++y)
            for (int x = range.x0; x <= range.x1; ++x)
                seen_[size_t(y * columns_ + x) * objects_ + id] = 1;
    }

    size_t append_to(std::vector<uint32_t>& entry, const SceneModel& model) const {
        const size_t begin = entry.size();
        entry.resize(begin + cells_ * (SCENE_SHAPES + 1));
        for (size_t cell = 0; cell < cells_; ++cell) {
            const size_t head = begin + cell * (SCENE_SHAPES + 1);
            for (int shape = 0; shape < SCENE_SHAPES; ++shape) {
                entry[head + size_t(shape)] = uint32_t(entry.size());
                for (size_t id = 0; id < objects_; ++id)
                    if (seen_[cell * objects_ + id] && int(model.objects[id].shape) == shape)
                        entry.push_back(uint32_t(id));
            }
            entry[head + SCENE_SHAPES] = uint32_t(entry.size());
        }
        return begin;
    }

  private:
    int columns_;
    size_t objects_;
    size_t cells_;
    std::vector<uint8_t> seen_;
};

struct CastingSphere {
    size_t id;
    glm::dvec3 center;  // world
    double radius;
};

std::vector<CastingSphere> casting_spheres(const SceneModel& model,
                                           const std::vector<std::vector<glm::dvec4>>& bounds,
                                           const std::vector<Instant>& instants) {
    std::vector<CastingSphere> spheres;
    for (const Instant& instant : instants)
        for (size_t id = 0; id < bounds.size(); ++id) {
            if (!model.objects[id].casts) continue;
            for (const glm::dvec4& sphere : bounds[id])
                spheres.push_back({id, instant.objects[id].to_world(glm::dvec3(sphere)), sphere.w});
        }
    return spheres;
}

glm::dvec2 across(const LightGrid& grid, glm::dvec3 world) {
    return {glm::dot(world, grid.right), glm::dot(world, grid.up)};
}

LightGrid grid_around(const std::vector<CastingSphere>& spheres, glm::dvec3 light) {
    LightGrid grid;
    const glm::dvec3 side = std::abs(light.y) < 0.9 ? glm::dvec3(0, 1, 0) : glm::dvec3(1, 0, 0);
    grid.right = glm::normalize(glm::cross(side, light));
    grid.up = glm::cross(light, grid.right);
    if (spheres.empty()) return grid;
    glm::dvec2 low(1e30), high(-1e30);
    for (const CastingSphere& sphere : spheres) {
        low = glm::min(low, across(grid, sphere.center) - sphere.radius);
        high = glm::max(high, across(grid, sphere.center) + sphere.radius);
    }
    // A small margin, because cells are looked up in float.
    const glm::dvec2 margin = 1e-3 * (high - low);
    grid.first = low - margin;
    grid.cells_per_unit = double(SCENE_LIGHT_GRID) / (high - low + 2.0 * margin);
    return grid;
}

}  // namespace

Instant instant_of(const SceneModel& model, double time) {
    Instant instant{model.camera(time), {}};
    instant.objects.reserve(model.objects.size());
    for (const Object& object : model.objects) instant.objects.push_back(object.pose(time));
    return instant;
}

CellLists cull(const SceneModel& model, const std::vector<Instant>& instants,
               const ImageGeometry& picture) {
    std::vector<std::vector<glm::dvec4>> bounds;
    for (const Object& object : model.objects) bounds.push_back(bounds_of(object));

    CellLists lists;
    const int columns = (picture.width + SCENE_TILE - 1) / SCENE_TILE;
    const int rows = (picture.height + SCENE_TILE - 1) / SCENE_TILE;
    SeenTable tiles(columns, rows, model.objects.size());
    for (const Instant& instant : instants) {
        const double focal_px = picture.focal_px(instant.camera);
        for (size_t id = 0; id < bounds.size(); ++id)
            for (const glm::dvec4& sphere : bounds[id]) {
                const glm::dvec3 world = instant.objects[id].to_world(glm::dvec3(sphere));
                tiles.add(
                    id, tiles_of(instant.camera.pose.to_local(world), sphere.w, focal_px, picture));
            }
    }
    lists.tiles = tiles.append_to(lists.entry, model);

    const auto spheres = casting_spheres(model, bounds, instants);
    lists.grid = grid_around(spheres, glm::normalize(model.light));
    SeenTable lights(SCENE_LIGHT_GRID, SCENE_LIGHT_GRID, model.objects.size());
    for (const CastingSphere& sphere : spheres) {
        const auto cell = [&](double side) {
            const glm::dvec2 at =
                (across(lists.grid, sphere.center) + side * sphere.radius - lists.grid.first) *
                lists.grid.cells_per_unit;
            return glm::clamp(glm::floor(at), 0.0, SCENE_LIGHT_GRID - 1.0);
        };
        const glm::dvec2 low = cell(-1), high = cell(1);
        lights.add(sphere.id, {int(low.x), int(low.y), int(high.x), int(high.y)});
    }
    lists.lights = lights.append_to(lists.entry, model);
    return lists;
}

}  // namespace postchain::scenes
