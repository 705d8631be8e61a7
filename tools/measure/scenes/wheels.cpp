#include "tools/measure/scenes/wheels.h"

#include <cmath>
#include <glm/gtc/constants.hpp>

namespace postchain::scenes {
namespace {

constexpr double kWheelsWall = 3.0;

struct Wheel {
    glm::dvec3 center;
    double radius;      // outer, with tire
    double pitch, yaw;  // radians, out of the image plane
    double rate;        // radians per frame, counter-clockwise in the image
    double angle;       // at frame 0
    glm::dvec3 color;
    std::vector<double> lamps;  // angles
};

void add_wheel(SceneModel& scene, const Wheel& wheel) {
    const glm::dmat3 tilt = turn({1, 0, 0}, wheel.pitch) * turn({0, 1, 0}, wheel.yaw);
    const auto pose = [wheel, tilt](glm::dvec3 offset) -> PoseAt {
        return [wheel, tilt, offset](double time) {
            const double angle =
                std::remainder(wheel.angle + wheel.rate * time, 2 * glm::pi<double>());
            return at(wheel.center, tilt * turn({0, 0, 1}, angle)) * at(offset);
        };
    };
    const double tube = 0.085 * wheel.radius, ring = wheel.radius - tube;
    Object tyre = torus(ring, tube, pose({0, 0, 0}), wheel.color);
    tyre.pattern = SCENE_TREAD;
    tyre.cell = 44;
    tyre.color_b = 0.06 * wheel.color;
    tyre.gloss = 0.5;
    scene.objects.push_back(tyre);

    Object spokes;
    spokes.shape = Shape::wheel;
    spokes.size = {ring - 0.55 * tube, 0.17 * wheel.radius, 10, 0.032 * wheel.radius};
    spokes.pose = pose({0, 0, 0});
    spokes.color = 0.9 * wheel.color;
    spokes.gloss = 0.6;
    scene.objects.push_back(spokes);

    for (double angle : wheel.lamps)
        scene.objects.push_back(lamp(0.03 * wheel.radius,
                                     pose({ring * std::cos(angle), ring * std::sin(angle), -tube}),
                                     30));
}

Object panel(double x, double y, double half_width, double half_height, int pattern, double cell,
             glm::dvec3 a, glm::dvec3 b, glm::dvec2 extra = {1, 0}) {
    Object object = rectangle(half_width, half_height, still(at({x, y, kWheelsWall - 0.02})), a);
    object.pattern = pattern;
    object.cell = cell;
    object.color_b = b;
    object.pattern_extra = extra;
    return object;
}

}  // namespace

SceneModel make_wheels() {
    SceneModel scene;
    scene.camera = [](double) { return CameraPose{Pose{}, 50, 1.3}; };
    scene.f_stop = 1.4;
    scene.light = {-0.14, 0.30, -1.0};
    scene.light_strength = 1.8;
    scene.ambient = {0.36, 0.37, 0.42};

    add_wheel(scene, {{-0.1035, -0.0585, 0.8},
                      0.116,
                      0.10,
                      -0.16,
                      -0.42,
                      0.30,
                      {0.85, 0.020, 0.012},
                      {0.5, 1.9, 2.9, 4.4, 5.6}});
    add_wheel(scene, {{0.022, 0.014, 1.3},
                      0.197,
                      -0.08,
                      0.12,
                      0.28,
                      0.15,
                      {0.02, 0.55, 0.05},
                      {0.9, 2.5, 4.1, 5.3}});
    add_wheel(scene, {{0.185, 0.155, 2.2},
                      0.345,
                      0.12,
                      0.20,
                      -0.33,
                      0.40,
                      {0.02, 0.06, 0.80},
                      {0.2, 1.7, 3.4, 5.0}});

    Object wall = rectangle(1.6, 1.0, still(at({0, 0, kWheelsWall})), {0.40, 0.085, 0.035});
    wall.pattern = SCENE_BRICKS;
    wall.cell = 0.052;
    wall.color_b = {0.17, 0.15, 0.13};
    scene.objects.push_back(wall);

    scene.objects.push_back(panel(-0.36, 0.44, 0.215, 0.165, SCENE_STRIPES, 0.043,
                                  {0.08, 0.30, 0.36}, {0.62, 0.17, 0.15}));
    scene.objects.push_back(panel(-1.02, 0.24, 0.07, 0.20, SCENE_CHECKER, 0.056, {0.55, 0.47, 0.12},
                                  {0.02, 0.03, 0.16}));
    scene.objects.push_back(
        panel(0.36, -0.50, 0.20, 0.13, SCENE_RINGS, 0.06, {0.34, 0.05, 0.48}, {0.62, 0.60, 0.55}));
    scene.objects.push_back(panel(0.68, -0.53, 0.13, 0.12, SCENE_CHECKER, 0.04, {0.60, 0.47, 0.10},
                                  {0.03, 0.05, 0.20}));
    scene.objects.push_back(
        panel(0.95, -0.50, 0.11, 0.15, SCENE_RINGS, 0.043, {0.03, 0.02, 0.08}, {0.28, 0.55, 0.30}));
    scene.objects.push_back(panel(-0.92, -0.55, 0.16, 0.05, SCENE_CHECKER, 0.025,
                                  {0.60, 0.07, 0.06}, {0.10, 0.55, 0.52}));
    scene.objects.push_back(panel(0.05, -0.565, 0.09, 0.05, SCENE_STRIPES, 0.03, {0.75, 0.55, 0.05},
                                  {0.02, 0.02, 0.02}, {0.7, 0.7}));
    const double sign_z = kWheelsWall - 0.015;
    scene.add_sign(0.17, 0.17, still(at({-0.50, 0.0, sign_z})), {0.22, 0.55, 0.16},
                   {0.02, 0.05, 0.02}, {"NO PARK", "F/1.4", "EXIT 23"});
    scene.add_sign(0.24, 0.16, still(at({0.86, -0.19, sign_z})), {0.45, 0.48, 0.72},
                   {0.03, 0.03, 0.05}, {"EXIT 23", "FIGURE 14", "BLUR"});
    scene.add_sign(0.075, 0.17, still(at({1.03, 0.27, sign_z})), {0.05, 0.38, 0.20},
                   {0.75, 0.75, 0.70}, {"B7", "B8", "25"});
    scene.add_sign(0.10, 0.10, still(at({-0.93, -0.14, sign_z})), {0.05, 0.10, 0.30},
                   {0.8, 0.8, 0.75}, {"TILE", "MAX"});
    scene.add_sign(0.20, 0.055, still(at({0.75, 0.51, sign_z})), {0.70, 0.52, 0.05},
                   {0.03, 0.03, 0.03}, {"SHUTTER"});

    const glm::dvec2 lights[] = {{-0.24, 0.52},  {0.99, 0.475}, {-0.72, 0.30}, {-0.98, 0.54},
                                 {-0.70, -0.32}, {0.52, -0.33}, {0.92, 0.05},  {-0.42, -0.47},
                                 {0.17, -0.40},  {0.60, 0.36},  {1.02, -0.57}};
    for (const glm::dvec2& place : lights)
        scene.objects.push_back(lamp(0.0135, still(at({place, kWheelsWall - 0.03})), 24));
    return scene;
}

}  // namespace postchain::scenes
