#include "tools/measure/scenes/zoom.h"

#include <cmath>
#include <glm/gtc/constants.hpp>

namespace postchain::scenes {
namespace {

constexpr double kZoomPeriod = 96;  // frames back and forth
constexpr double kDrive = 2.6;      // scene units to each side of the center
constexpr double kZoom = 0.22;      // its exp() is the largest change of focal length
constexpr double kTarget = 7.0;     // focused distance
constexpr double kZoomGround = -0.45;

CameraPose zoom_camera(double time) {
    const double swing = std::sin(2 * glm::pi<double>() / kZoomPeriod * time);
    return {at({0, 0, kDrive * swing}), 38 * std::exp(kZoom * swing), kTarget - kDrive * swing};
}

}  // namespace

SceneModel make_zoom() {
    SceneModel scene;
    scene.camera = zoom_camera;
    scene.f_stop = 0.5;
    scene.far_clip = 100;
    scene.light = {0.7, 0.7, -0.5};
    scene.light_strength = 2.4;
    Random random(5);

    Object ground =
        rectangle(30, 45, still(at({0, kZoomGround, 40}, turn({1, 0, 0}, 0.5 * glm::pi<double>()))),
                  {0.26, 0.21, 0.16});
    ground.pattern = SCENE_TILES;
    ground.cell = 0.5;
    ground.color_b = {0.11, 0.095, 0.09};
    scene.objects.push_back(ground);

    const glm::dvec3 colors[] = {{0.62, 0.03, 0.02},
                                 {0.02, 0.16, 0.62},
                                 {0.70, 0.40, 0.02},
                                 {0.03, 0.38, 0.06},
                                 {0.42, 0.04, 0.50}};
    for (int i = 0; i < 9; ++i) {
        const double z = 4.4 + 2.2 * i;
        for (const double side : {-1.0, 1.0}) {
            const double x = side * 1.05;
            const glm::dvec3 color = colors[(i + (side > 0 ? 2 : 0)) % 5];
            Object plinth =
                box({0.15, 0.12, 0.15}, still(at({x, kZoomGround + 0.12, z})), {0.42, 0.40, 0.37});
            plinth.pattern = SCENE_CHECKER;
            plinth.cell = 0.06;
            plinth.color_b = {0.25, 0.24, 0.23};
            scene.objects.push_back(plinth);
            Object column = rod(0.42, 0.07, still(at({x, 0.25, z})), color);
            column.pattern = SCENE_CHECKER;
            column.cell = 0.14;
            column.color_b = {0.70, 0.68, 0.62};
            scene.objects.push_back(column);
            scene.objects.push_back(lamp(0.05, still(at({x, 0.80, z})), 16));
        }
    }
    for (int i = 0; i < 3; ++i) {
        Object gate = torus(0.75, 0.05, still(at({0, 0.28, 5.6 + 4.4 * i})), colors[(i + 2) % 5]);
        gate.pattern = SCENE_TREAD;
        gate.cell = 24;
        gate.color_b = {0.75, 0.72, 0.68};
        scene.objects.push_back(gate);
    }
    for (int i = 0; i < 26; ++i) {
        const double z = random.between(3.6, 16), radius = random.between(0.04, 0.14);
        const double side = i % 2 ? 1.0 : -1.0;
        Object ball =
            sphere(radius, still(at({side * random.between(0.28, 0.85), kZoomGround + radius, z})),
                   colors[i % 5]);
        ball.gloss = 1.2;
        scene.objects.push_back(ball);
    }
    for (int i = 0; i < 16; ++i) {
        const double side = i % 2 ? 1.0 : -1.0, z = 5 + 1.9 * (i / 2);
        const double half_height = random.between(0.4, 1.15);
        Object building =
            box({0.6, half_height, 0.8},
                still(at({side * random.between(2.3, 3.0), kZoomGround + half_height, z})),
                0.04 + 0.7 * colors[(i + i / 2) % 5]);
        building.pattern = SCENE_WINDOWS;
        building.cell = 0.22;
        building.color_b = {0.03, 0.04, 0.06};
        building.pattern_extra = {double(i), 9};
        scene.objects.push_back(building);
    }
    scene.add_sign(0.40, 0.20, still(at({0, 0.30, kTarget})), {0.70, 0.52, 0.05},
                   {0.03, 0.03, 0.03}, {"ZOOM", "96 FRAMES"});
    scene.objects.back().casts = true;
    scene.objects.push_back(wire({-0.32, kZoomGround, kTarget + 0.02},
                                 {-0.32, 0.45, kTarget + 0.02}, 0.02, {0.3, 0.3, 0.32}));
    scene.objects.push_back(wire({0.32, kZoomGround, kTarget + 0.02}, {0.32, 0.45, kTarget + 0.02},
                                 0.02, {0.3, 0.3, 0.32}));
    return scene;
}

}  // namespace postchain::scenes
