#include "tools/measure/scenes/crossing.h"

#include <cmath>
#include <glm/gtc/constants.hpp>

namespace postchain::scenes {
namespace {

constexpr double kCrossingWall = 3.0;
constexpr double kFocalPx = 50.0 / 36.0 * 640;  // pixels per unit slope, 640 wide

// Position on a straight path through the view at depth z that starts over out of view.
PoseAt crossing(glm::dvec2 start, double z, glm::dvec2 velocity, double radius, glm::dvec3 axis,
                double angle, double rate) {
    // Out of view at both ends by more than one frame's path, so that no motion vector includes the
    // jump.
    const glm::dvec2 half =
        z * glm::dvec2(18.0, 10.2) / 50.0 + 1.6 * radius + 1.5 * glm::abs(velocity);
    return [=](double time) {
        const glm::dvec2 way = start + velocity * time;
        const glm::dvec2 place = way - 2.0 * half * glm::round(way / (2.0 * half));
        return at({place, z},
                  turn(axis, std::remainder(angle + rate * time, 2 * glm::pi<double>())));
    };
}

glm::dvec3 hue(double h) {
    const auto part = [h](double shift) {
        const double x = std::abs(std::fmod(h + shift, 1.0) * 6 - 3) - 1;
        return std::clamp(x, 0.0, 1.0);
    };
    const glm::dvec3 c(part(0), part(2.0 / 3), part(1.0 / 3));
    return 0.015 + 0.65 * c * c;
}

}  // namespace

SceneModel make_crossing() {
    SceneModel scene;
    scene.camera = [](double) { return CameraPose{Pose{}, 50, 1.4}; };
    scene.f_stop = 1.4;
    scene.background_opaque = false;
    scene.light = {0.22, 0.35, -0.9};
    Random random(20);

    Object wall = rectangle(1.6, 1.0, still(at({0, 0, kCrossingWall})), {0.38, 0.09, 0.04});
    wall.pattern = SCENE_BRICKS;
    wall.cell = 0.06;
    wall.color_b = {0.17, 0.15, 0.13};
    wall.hole = {0.52, 0.24, 0.20, 0};
    scene.objects.push_back(wall);
    Object frame = torus(0.21, 0.02, still(at({0.52, 0.24, kCrossingWall})), {0.55, 0.42, 0.15});
    scene.objects.push_back(frame);
    Object stripes =
        rectangle(0.22, 0.17, still(at({-0.30, 0.36, kCrossingWall - 0.02})), {0.10, 0.30, 0.28});
    stripes.pattern = SCENE_STRIPES;
    stripes.cell = 0.045;
    stripes.color_b = {0.52, 0.16, 0.20};
    stripes.pattern_extra = {1, 0};
    scene.objects.push_back(stripes);
    Object rings =
        rectangle(0.15, 0.13, still(at({0.88, -0.44, kCrossingWall - 0.02})), {0.40, 0.06, 0.50});
    rings.pattern = SCENE_RINGS;
    rings.cell = 0.05;
    rings.color_b = {0.55, 0.55, 0.50};
    scene.objects.push_back(rings);
    Object checks =
        rectangle(0.22, 0.12, still(at({0.25, -0.46, kCrossingWall - 0.02})), {0.62, 0.50, 0.08});
    checks.pattern = SCENE_CHECKER;
    checks.cell = 0.045;
    checks.color_b = {0.03, 0.05, 0.22};
    scene.objects.push_back(checks);
    scene.add_sign(0.26, 0.18, still(at({-0.68, -0.08, kCrossingWall - 0.02})), {0.20, 0.52, 0.15},
                   {0.03, 0.06, 0.03}, {"NO PARKING", "F/1.4", "EXIT 23"});
    scene.add_sign(0.20, 0.12, still(at({-0.50, -0.46, kCrossingWall - 0.02})), {0.05, 0.12, 0.32},
                   {0.75, 0.75, 0.70}, {"SHUTTER", "CROSSING"});
    const glm::dvec2 lights[] = {{-0.95, 0.50}, {0.05, 0.52},  {0.98, 0.52}, {-0.98, -0.52},
                                 {0.55, -0.22}, {-0.10, 0.02}, {1.00, 0.05}};
    for (const glm::dvec2& place : lights)
        scene.objects.push_back(lamp(0.013, still(at({place, kCrossingWall - 0.03})), 26));

    constexpr int kCount = 90;
    for (int i = 0; i < kCount; ++i) {
        const double z = random.between(0.7, 2.6);
        const double radius = z * random.between(0.016, 0.034);
        // Speeds evenly spaced in their logarithm; eight directions, slightly perturbed.
        const double px = 6 * std::pow(88.0 / 6, (i + 0.5) / kCount);
        const double heading = (i * 3 % 8) * glm::pi<double>() / 4 + random.between(-0.15, 0.15);
        const glm::dvec2 velocity =
            px * z / kFocalPx * glm::dvec2(std::cos(heading), std::sin(heading));
        const glm::dvec2 start(random.between(-0.4, 0.4) * z, random.between(-0.24, 0.24) * z);
        const glm::dvec3 axis = glm::normalize(
            glm::dvec3(random.between(-1, 1), random.between(-1, 1), random.between(-1, 1)));
        const PoseAt pose = crossing(start, z, velocity, 2 * radius, axis, random.between(0, 6.28),
                                     random.between(-0.12, 0.12));
        const glm::dvec3 color = hue(random.between(0, 1));
        const int kind = i % 6;
        Object object = kind == 0   ? sphere(radius, pose, color)
                        : kind == 1 ? box(radius * glm::dvec3(0.9, 0.8, 0.85), pose, color)
                        : kind == 2 ? torus(radius, 0.32 * radius, pose, color)
                        : kind == 3 ? rod(1.3 * radius, 0.3 * radius, pose, color)
                        : kind == 4 ? box(radius * glm::dvec3(1.5, 0.3, 0.3), pose, color)
                                    : sphere(0.85 * radius, pose, color);
        if (i % 4 == 1) {
            object.pattern = SCENE_CHECKER;
            object.cell = 0.45 * radius;
            object.color_b = glm::dvec3(0.75) - 0.9 * color;
            object.color_b = glm::max(object.color_b, glm::dvec3(0.03));
        }
        if (i % 13 == 5) object = lamp(0.35 * radius, pose, 20);
        scene.objects.push_back(object);
    }

    Object pane = rectangle(0.12, 0.09,
                            crossing({0.05, 0.02}, 1.05, glm::dvec2(16, 6) * 1.05 / kFocalPx, 0.16,
                                     {0, 0, 1}, 0.3, 0.03),
                            {0.10, 0.55, 0.60});
    pane.alpha = 0.5;
    pane.gloss = 0.4;
    scene.objects.push_back(pane);
    return scene;
}

}  // namespace postchain::scenes
