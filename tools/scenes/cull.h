// Finds the objects visible in each tile of an image, and those that can shade each cell of a grid
// across the light. Conservative: uses bounding spheres (for tiles, grown by the circle of
// confusion) at exactly the time samples that are rendered.
#pragma once

#include <cstdint>
#include <vector>

#include "tools/scenes/model.h"

namespace postchain::scenes {

struct Instant {
    CameraPose camera;
    std::vector<Pose> objects;
};
Instant instant_of(const SceneModel& model, double time);

struct ImageGeometry {
    int width = 0;
    int height = 0;
    double sensor_width_mm = 36;
    double lens_radius = 0;     // scene units
    double focus_distance = 1;  // scene units

    double focal_px(const CameraPose& camera) const {
        return camera.focal_length_mm / sensor_width_mm * width;
    }
};

struct LightGrid {
    glm::dvec3 right{1, 0, 0}, up{0, 1, 0};  // unit vectors across the light
    glm::dvec2 first{0.0};                   // lowest coordinates, scene units
    glm::dvec2 cells_per_unit{1.0};
};

// For cell c of a table that begins at b, and shape s: entries [entry[b + c (S+1) + s], entry[b + c
// (S+1) + s + 1]) are object indices, S = SCENE_SHAPES. Cells are row-major.
struct CellLists {
    std::vector<uint32_t> entry;
    size_t tiles = 0;   // start of the image's tiles, from the top left
    size_t lights = 0;  // start of the light's cells, SCENE_LIGHT_GRID per side
    LightGrid grid;
};
CellLists cull(const SceneModel& model, const std::vector<Instant>& instants,
               const ImageGeometry& picture);

}  // namespace postchain::scenes
