#include "tools/measure/scenes/poles.h"

#include <cmath>
#include <glm/gtc/constants.hpp>

namespace postchain::scenes {
namespace {

constexpr double kPolesGround = -0.75;
constexpr double kPolesPeriod = 60;  // frames of a pan back and forth

// Fastest at frame 0, 2.6 degrees per frame.
CameraPose poles_camera(double time) {
    const double yaw = 0.43 * std::sin(2 * glm::pi<double>() / kPolesPeriod * time);
    return {at({0, 0, 0}, turn({0, 1, 0}, yaw)), 50, 1.6};
}

// A pose `distance` away in direction `yaw`, facing the camera.
Pose around(double yaw, double distance, double y) {
    return at({distance * std::sin(yaw), y, distance * std::cos(yaw)}, turn({0, 1, 0}, yaw));
}

// Attached to the camera, swinging about a pivot given in camera coordinates.
PoseAt riding(glm::dvec3 pivot, double rest, double amplitude, double rate, double drop) {
    return [=](double time) {
        const double angle = rest + amplitude * std::sin(rate * time);
        return poles_camera(time).pose * at(pivot, turn({0, 0, 1}, angle)) * at({0, -drop, 0});
    };
}

}  // namespace

SceneModel make_poles() {
    SceneModel scene;
    scene.camera = poles_camera;
    scene.f_stop = 1.4;
    scene.light = {0.5, 0.6, -0.6};

    Random random(11);

    Object ground =
        rectangle(20, 20, still(at({0, kPolesGround, 0}, turn({1, 0, 0}, 0.5 * glm::pi<double>()))),
                  {0.20, 0.19, 0.18});
    ground.pattern = SCENE_TILES;
    ground.cell = 0.35;
    ground.color_b = {0.13, 0.125, 0.12};
    scene.objects.push_back(ground);

    const glm::dvec3 facades[] = {{0.42, 0.38, 0.18}, {0.25, 0.45, 0.44}, {0.40, 0.16, 0.42},
                                  {0.16, 0.08, 0.20}, {0.14, 0.22, 0.36}, {0.12, 0.26, 0.10},
                                  {0.48, 0.27, 0.17}};
    double yaw = -1.15;
    for (int i = 0; yaw < 1.15; ++i) {
        const double half = random.between(0.17, 0.36), distance = random.between(5.6, 6.6);
        const double half_height = 0.5 * random.between(0.75, 1.75) + 0.05;
        Object tower =
            rectangle(half, half_height, still(around(yaw, distance, kPolesGround + half_height)),
                      facades[i % 7]);
        tower.pattern = SCENE_WINDOWS;
        tower.cell = random.between(0.05, 0.08);
        tower.color_b = {0.05, 0.07, 0.10};
        tower.pattern_extra = {double(i), 14};
        scene.objects.push_back(tower);
        if (i % 3 == 1)
            scene.add_sign(0.7 * half, 0.11,
                           still(around(yaw, distance - 0.05,
                                        kPolesGround + half_height * random.between(1.2, 1.7))),
                           {0.06, 0.05, 0.07}, {1.0, 0.12, 0.08}, {i % 2 ? "F/1.4" : "MOTION"});
        if (i % 2 == 0) {
            const glm::dvec3 roof = around(yaw, distance, kPolesGround + 2 * half_height).position;
            scene.objects.push_back(
                wire(roof, roof + glm::dvec3(0, 0.35, 0), 0.008, {0.1, 0.1, 0.12}));
            scene.objects.push_back(lamp(0.018, still(at(roof + glm::dvec3(0, 0.36, 0))), 22));
        }
        yaw += (half + random.between(0.10, 0.24)) / distance * 1.35;
    }

    // Poles and wires fixed in the world.
    const glm::dvec3 colors[] = {{0.62, 0.04, 0.03},
                                 {0.78, 0.76, 0.70},
                                 {0.03, 0.03, 0.035},
                                 {0.70, 0.52, 0.05},
                                 {0.35, 0.45, 0.60}};
    for (int i = 0; i < 15; ++i) {
        const double turned = -0.95 + 0.135 * i + random.between(-0.03, 0.03);
        const double distance = random.between(1.1, 3.4), slant = random.between(-0.12, 0.12);
        const glm::dvec3 foot = around(turned, distance, kPolesGround).position;
        const glm::dvec3 top = around(turned + slant, distance, 1.3).position;
        scene.objects.push_back(wire(foot, top, random.between(0.0018, 0.0065), colors[i % 5]));
        if (i % 3 == 0)
            scene.objects.push_back(lamp(
                0.012, still(at(foot + 0.47 * (top - foot) + glm::dvec3(0.02, 0, -0.02))), 26));
    }
    for (int i = 0; i < 12; ++i) {
        const double from = random.between(-1.1, 0.5), distance = random.between(1.0, 3.2);
        const double low = random.between(-0.12, 0.32) * distance;
        const glm::dvec3 a = around(from, distance, low).position;
        const glm::dvec3 b =
            around(from + random.between(0.4, 0.8), distance * random.between(0.8, 1.4),
                   low + random.between(-0.15, 0.15) * distance)
                .position;
        scene.objects.push_back(wire(a, b, random.between(0.0009, 0.0026), colors[(i + 1) % 5]));
    }

    // A banner on a pole fixed in the world.
    const double at_yaw = 0.21;
    const glm::dvec3 mast = around(at_yaw, 1.75, 0).position;
    scene.objects.push_back(
        wire({mast.x, kPolesGround, mast.z}, {mast.x, 1.2, mast.z}, 0.009, {0.75, 0.73, 0.70}));
    Object banner = rectangle(
        0.20, 0.14,
        [=](double time) {
            const double wave = 0.35 + 0.3 * std::sin(0.5 * time);
            return at({mast.x, 0.21, mast.z}, turn({0, 1, 0}, at_yaw + wave)) * at({0.21, 0, 0});
        },
        {0.45, 0.03, 0.03});
    banner.pattern = SCENE_PLAID;
    banner.cell = 0.10;
    banner.casts = true;
    banner.color_b = {0.03, 0.05, 0.22};
    scene.objects.push_back(banner);

    // Attached to the camera: swinging but never leaving the image.
    scene.objects.push_back(
        rod(0.30, 0.0032, riding({-0.16, 0.28, 1.0}, 0.10, 0, 0, 0.30), {0.03, 0.03, 0.03}));
    scene.objects.push_back(
        rod(0.10, 0.0055, riding({-0.27, 0.10, 1.15}, 1.02, 0, 0, 0.13), {0.05, 0.05, 0.05}));
    scene.objects.push_back(
        rod(0.5, 0.006, riding({-0.12, 0.40, 1.6}, 0, 0, 0, 0.45), {0.65, 0.05, 0.03}));
    scene.objects.push_back(
        rod(0.27, 0.0026, riding({0.30, 0.30, 1.25}, -0.30, 0.22, 0.55, 0.30), {0.70, 0.05, 0.03}));
    scene.objects.push_back(
        rod(0.20, 0.003, riding({-0.02, 0.34, 1.3}, 0.05, 0.30, -0.48, 0.24), {0.72, 0.55, 0.05}));
    scene.objects.push_back(lamp(0.011, riding({-0.02, 0.34, 1.3}, 0.05, 0.30, -0.48, 0.46), 28));
    return scene;
}

}  // namespace postchain::scenes
