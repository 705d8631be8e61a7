// A scene as plain data: solids with time-dependent poses, a camera, a light.
//
// World axes: x right, y up, z forward (a camera at rest looks along +z). Lengths in scene units
// (meters), angles in radians, time in frames. Poses are evaluated in double precision at every
// time sample; shaders/scenes/ receives rows of float.
#pragma once

#include <functional>
#include <glm/glm.hpp>
#include <string>
#include <utility>
#include <vector>

#include "chain/frame/frame.h"
#include "shaders/shared/scene_uniforms.h"

namespace postchain::scenes {

// Local to world: rotation * local + position.
struct Pose {
    glm::dmat3 rotation{1.0};
    glm::dvec3 position{0.0};

    glm::dvec3 to_world(glm::dvec3 local) const { return rotation * local + position; }
    glm::dvec3 to_local(glm::dvec3 world) const {
        return glm::transpose(rotation) * (world - position);
    }
};
Pose operator*(const Pose& outer, const Pose& inner);

glm::dmat3 turn(glm::dvec3 axis, double angle);  // right-handed about a unit axis
Pose at(glm::dvec3 position, glm::dmat3 rotation = glm::dmat3(1.0));

using PoseAt = std::function<Pose(double time)>;
PoseAt still(const Pose& pose);

enum class Shape {
    rectangle = SCENE_RECTANGLE,
    sphere = SCENE_SPHERE,
    box = SCENE_BOX,
    rod = SCENE_ROD,
    torus = SCENE_TORUS,
    wheel = SCENE_WHEEL,
};

struct Object {
    Shape shape = Shape::sphere;
    glm::dvec4 size{0.0};  // by shape, see shaders/scenes/shapes.glsl
    PoseAt pose;
    glm::dvec3 color{0.5};    // scene-linear Rec. 709
    glm::dvec3 color_b{0.1};  // second color of the pattern
    int pattern = SCENE_PLAIN;
    double period = 1;  // pattern's period, scene units; torus: number of tread blocks around
    glm::dvec2 pattern_extra{0.0};
    glm::dvec4 hole{0.0};  // rectangle: center x, y and radius; w: text lines
    double gloss = 0;
    double lamp = 0;    // radiance = color * lamp, unlit; 0 = a surface
    bool casts = true;  // a shadow; off by default for rectangles
    double alpha = 1;   // 1 = opaque; below 1 blended with the background
};

Object rectangle(double half_width, double half_height, PoseAt pose, glm::dvec3 color);
Object sphere(double radius, PoseAt pose, glm::dvec3 color);
Object box(glm::dvec3 half_size, PoseAt pose, glm::dvec3 color);
Object rod(double half_length, double radius, PoseAt pose, glm::dvec3 color);  // along y
Object torus(double ring, double tube, PoseAt pose, glm::dvec3 color);         // about z
Object lamp(double radius, PoseAt pose, double radiance);
Object wire(glm::dvec3 from, glm::dvec3 to, double radius, glm::dvec3 color);
Object patterned(Object object, int pattern, double period, glm::dvec3 color_b,
                 glm::dvec2 extra = glm::dvec2(0.0));
Object glossy(Object object, double gloss);

struct CameraPose {
    Pose pose;
    double focal_length_mm = 50;
    double focus_distance = 1;
};

struct SceneModel {
    std::vector<Object> objects;
    std::vector<uint32_t> letters;  // columns of texts, 7 bits each
    std::function<CameraPose(double time)> camera;
    // Has every value but focal length and focus, which `camera` has; blades or an image.
    Camera lens = {.sensor_width_mm = 36,
                   .f_stop = 2,
                   .near_clip = 0.05,
                   .far_clip = 60,
                   .shutter_frames = kDefaultShutterFrames,
                   .shutter_position = ShutterPosition::center,
                   .meters_per_unit = 1,
                   .aperture_blades = 0,
                   .aperture_rotation_deg = 0,
                   .aperture_curvature = 0,
                   .aperture_ratio = 1,
                   .cats_eye = 0};

    glm::dvec3 light{-0.4, 0.6, -0.7};  // towards the light; need not be a unit vector
    double light_strength = 1.9;
    glm::dvec3 zenith{0.05, 0.15, 0.50};
    glm::dvec3 horizon{0.36, 0.50, 0.80};
    double clouds = 0.9;
    glm::dvec3 ambient{0.34, 0.38, 0.48};
    double ambient_below = 0.5;
    bool background_opaque = true;  // false: alpha 0 where no surface is hit

    void add(Object object) { objects.push_back(std::move(object)); }
    // Adds a rectangular sign with these lines of text; letters are A-Z, 0-9, '.', '/', '-' and
    // blank.
    void add_sign(double half_width, double half_height, PoseAt pose, glm::dvec3 color,
                  glm::dvec3 letter_color, const std::vector<std::string>& lines);
};

// Random numbers for layouts, equal on every machine.
class Random {
  public:
    explicit Random(uint64_t seed) : state_(seed) {}
    double between(double low, double high);

  private:
    uint64_t state_;
};

// Spheres in local coordinates (xyz, radius) that together enclose the object.
std::vector<glm::dvec4> bounds_of(const Object& object);

}  // namespace postchain::scenes
