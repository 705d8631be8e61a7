#include "tools/scenes/scene_models.h"

#include <algorithm>
#include <cmath>
#include <glm/gtc/constants.hpp>

namespace postchain::scenes {
namespace {

// --------------------------------------------------------------------------------------- wheels

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
    tyre.period = 44;
    tyre.color_b = 0.06 * wheel.color;
    tyre.gloss = 0.5;
    scene.add(tyre);

    Object spokes;
    spokes.shape = Shape::wheel;
    spokes.size = {ring - 0.55 * tube, 0.17 * wheel.radius, 10, 0.032 * wheel.radius};
    spokes.pose = pose({0, 0, 0});
    spokes.color = 0.9 * wheel.color;
    spokes.gloss = 0.6;
    scene.add(spokes);

    for (double angle : wheel.lamps)
        scene.add(lamp(0.03 * wheel.radius,
                       pose({ring * std::cos(angle), ring * std::sin(angle), -tube}), 30));
}

Object panel(double x, double y, double half_width, double half_height, int pattern, double period,
             glm::dvec3 a, glm::dvec3 b, glm::dvec2 extra = {1, 0}) {
    return patterned(rectangle(half_width, half_height, still(at({x, y, kWheelsWall - 0.02})), a),
                     pattern, period, b, extra);
}

// Figure 14 of Guertin and Nowrouzezahrai's report (2013) with new geometry: a near red wheel, a
// green one in focus and a far blue one, each with its own speed and direction, before a brick
// wall.
SceneModel make_wheels() {
    SceneModel scene;
    scene.camera = [](double) { return CameraPose{Pose{}, 50, 1.3}; };
    scene.lens.f_stop = 1.4;
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

    scene.add(patterned(rectangle(1.6, 1.0, still(at({0, 0, kWheelsWall})), {0.40, 0.085, 0.035}),
                        SCENE_BRICKS, 0.052, {0.17, 0.15, 0.13}));

    scene.add(panel(-0.36, 0.44, 0.215, 0.165, SCENE_STRIPES, 0.043, {0.08, 0.30, 0.36},
                    {0.62, 0.17, 0.15}));
    scene.add(panel(-1.02, 0.24, 0.07, 0.20, SCENE_CHECKER, 0.056, {0.55, 0.47, 0.12},
                    {0.02, 0.03, 0.16}));
    scene.add(
        panel(0.36, -0.50, 0.20, 0.13, SCENE_RINGS, 0.06, {0.34, 0.05, 0.48}, {0.62, 0.60, 0.55}));
    scene.add(panel(0.68, -0.53, 0.13, 0.12, SCENE_CHECKER, 0.04, {0.60, 0.47, 0.10},
                    {0.03, 0.05, 0.20}));
    scene.add(
        panel(0.95, -0.50, 0.11, 0.15, SCENE_RINGS, 0.043, {0.03, 0.02, 0.08}, {0.28, 0.55, 0.30}));
    scene.add(panel(-0.92, -0.55, 0.16, 0.05, SCENE_CHECKER, 0.025, {0.60, 0.07, 0.06},
                    {0.10, 0.55, 0.52}));
    scene.add(panel(0.05, -0.565, 0.09, 0.05, SCENE_STRIPES, 0.03, {0.75, 0.55, 0.05},
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
        scene.add(lamp(0.0135, still(at({place, kWheelsWall - 0.03})), 24));
    return scene;
}

// ---------------------------------------------------------------------------------------- poles

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

// Thin objects during a fast pan, as in figure 11 of the report: poles and wires sweep by, others
// are attached to the camera, static or swinging, before a city with lit windows, ground and sky.
SceneModel make_poles() {
    SceneModel scene;
    scene.camera = poles_camera;
    scene.lens.f_stop = 1.4;
    scene.light = {0.5, 0.6, -0.6};

    Random random(11);

    scene.add(patterned(
        rectangle(20, 20, still(at({0, kPolesGround, 0}, turn({1, 0, 0}, 0.5 * glm::pi<double>()))),
                  {0.20, 0.19, 0.18}),
        SCENE_TILES, 0.35, {0.13, 0.125, 0.12}));

    const glm::dvec3 facades[] = {{0.42, 0.38, 0.18}, {0.25, 0.45, 0.44}, {0.40, 0.16, 0.42},
                                  {0.16, 0.08, 0.20}, {0.14, 0.22, 0.36}, {0.12, 0.26, 0.10},
                                  {0.48, 0.27, 0.17}};
    double yaw = -1.15;
    for (int i = 0; yaw < 1.15; ++i) {
        const double half = random.between(0.17, 0.36), distance = random.between(5.6, 6.6);
        const double half_height = 0.5 * random.between(0.75, 1.75) + 0.05;
        scene.add(patterned(
            rectangle(half, half_height, still(around(yaw, distance, kPolesGround + half_height)),
                      facades[i % 7]),
            SCENE_WINDOWS, random.between(0.05, 0.08), {0.05, 0.07, 0.10}, {double(i), 14}));
        if (i % 3 == 1)
            scene.add_sign(0.7 * half, 0.11,
                           still(around(yaw, distance - 0.05,
                                        kPolesGround + half_height * random.between(1.2, 1.7))),
                           {0.06, 0.05, 0.07}, {1.0, 0.12, 0.08}, {i % 2 ? "F/1.4" : "MOTION"});
        if (i % 2 == 0) {
            const glm::dvec3 roof = around(yaw, distance, kPolesGround + 2 * half_height).position;
            scene.add(wire(roof, roof + glm::dvec3(0, 0.35, 0), 0.008, {0.1, 0.1, 0.12}));
            scene.add(lamp(0.018, still(at(roof + glm::dvec3(0, 0.36, 0))), 22));
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
        scene.add(wire(foot, top, random.between(0.0018, 0.0065), colors[i % 5]));
        if (i % 3 == 0)
            scene.add(lamp(0.012,
                           still(at(foot + 0.47 * (top - foot) + glm::dvec3(0.02, 0, -0.02))), 26));
    }
    for (int i = 0; i < 12; ++i) {
        const double from = random.between(-1.1, 0.5), distance = random.between(1.0, 3.2);
        const double low = random.between(-0.12, 0.32) * distance;
        const glm::dvec3 a = around(from, distance, low).position;
        const glm::dvec3 b =
            around(from + random.between(0.4, 0.8), distance * random.between(0.8, 1.4),
                   low + random.between(-0.15, 0.15) * distance)
                .position;
        scene.add(wire(a, b, random.between(0.0009, 0.0026), colors[(i + 1) % 5]));
    }

    // A banner on a pole fixed in the world.
    const double at_yaw = 0.21;
    const glm::dvec3 mast = around(at_yaw, 1.75, 0).position;
    scene.add(
        wire({mast.x, kPolesGround, mast.z}, {mast.x, 1.2, mast.z}, 0.009, {0.75, 0.73, 0.70}));
    Object banner = rectangle(
        0.20, 0.14,
        [=](double time) {
            const double wave = 0.35 + 0.3 * std::sin(0.5 * time);
            return at({mast.x, 0.21, mast.z}, turn({0, 1, 0}, at_yaw + wave)) * at({0.21, 0, 0});
        },
        {0.45, 0.03, 0.03});
    banner.pattern = SCENE_PLAID;
    banner.period = 0.10;
    banner.casts = true;
    banner.color_b = {0.03, 0.05, 0.22};
    scene.add(banner);

    // Attached to the camera: swinging but never leaving the image.
    scene.add(rod(0.30, 0.0032, riding({-0.16, 0.28, 1.0}, 0.10, 0, 0, 0.30), {0.03, 0.03, 0.03}));
    scene.add(rod(0.10, 0.0055, riding({-0.27, 0.10, 1.15}, 1.02, 0, 0, 0.13), {0.05, 0.05, 0.05}));
    scene.add(rod(0.5, 0.006, riding({-0.12, 0.40, 1.6}, 0, 0, 0, 0.45), {0.65, 0.05, 0.03}));
    scene.add(
        rod(0.27, 0.0026, riding({0.30, 0.30, 1.25}, -0.30, 0.22, 0.55, 0.30), {0.70, 0.05, 0.03}));
    scene.add(
        rod(0.20, 0.003, riding({-0.02, 0.34, 1.3}, 0.05, 0.30, -0.48, 0.24), {0.72, 0.55, 0.05}));
    scene.add(lamp(0.011, riding({-0.02, 0.34, 1.3}, 0.05, 0.30, -0.48, 0.46), 28));
    return scene;
}

// ------------------------------------------------------------------------------------- crossing

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

// Many solids crossing at 6 to 88 pixels per frame (at 640 px width) in all directions and depths,
// before a wall with a round hole of alpha 0. One pane has alpha 0.5. A solid that leaves the image
// re-enters on the opposite side.
SceneModel make_crossing() {
    SceneModel scene;
    scene.camera = [](double) { return CameraPose{Pose{}, 50, 1.4}; };
    scene.lens.f_stop = 1.4;
    scene.background_opaque = false;
    scene.light = {0.22, 0.35, -0.9};
    Random random(20);

    Object wall = rectangle(1.6, 1.0, still(at({0, 0, kCrossingWall})), {0.38, 0.09, 0.04});
    wall.pattern = SCENE_BRICKS;
    wall.period = 0.06;
    wall.color_b = {0.17, 0.15, 0.13};
    wall.hole = {0.52, 0.24, 0.20, 0};
    scene.add(wall);
    scene.add(torus(0.21, 0.02, still(at({0.52, 0.24, kCrossingWall})), {0.55, 0.42, 0.15}));
    scene.add(patterned(
        rectangle(0.22, 0.17, still(at({-0.30, 0.36, kCrossingWall - 0.02})), {0.10, 0.30, 0.28}),
        SCENE_STRIPES, 0.045, {0.52, 0.16, 0.20}, {1, 0}));
    scene.add(patterned(
        rectangle(0.15, 0.13, still(at({0.88, -0.44, kCrossingWall - 0.02})), {0.40, 0.06, 0.50}),
        SCENE_RINGS, 0.05, {0.55, 0.55, 0.50}));
    scene.add(patterned(
        rectangle(0.22, 0.12, still(at({0.25, -0.46, kCrossingWall - 0.02})), {0.62, 0.50, 0.08}),
        SCENE_CHECKER, 0.045, {0.03, 0.05, 0.22}));
    scene.add_sign(0.26, 0.18, still(at({-0.68, -0.08, kCrossingWall - 0.02})), {0.20, 0.52, 0.15},
                   {0.03, 0.06, 0.03}, {"NO PARKING", "F/1.4", "EXIT 23"});
    scene.add_sign(0.20, 0.12, still(at({-0.50, -0.46, kCrossingWall - 0.02})), {0.05, 0.12, 0.32},
                   {0.75, 0.75, 0.70}, {"SHUTTER", "CROSSING"});
    const glm::dvec2 lights[] = {{-0.95, 0.50}, {0.05, 0.52},  {0.98, 0.52}, {-0.98, -0.52},
                                 {0.55, -0.22}, {-0.10, 0.02}, {1.00, 0.05}};
    for (const glm::dvec2& place : lights)
        scene.add(lamp(0.013, still(at({place, kCrossingWall - 0.03})), 26));

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
            object.period = 0.45 * radius;
            object.color_b = glm::dvec3(0.75) - 0.9 * color;
            object.color_b = glm::max(object.color_b, glm::dvec3(0.03));
        }
        if (i % 13 == 5) object = lamp(0.35 * radius, pose, 20);
        scene.add(object);
    }

    Object pane = rectangle(0.12, 0.09,
                            crossing({0.05, 0.02}, 1.05, glm::dvec2(16, 6) * 1.05 / kFocalPx, 0.16,
                                     {0, 0, 1}, 0.3, 0.03),
                            {0.10, 0.55, 0.60});
    pane.alpha = 0.5;
    pane.gloss = 0.4;
    scene.add(pane);
    return scene;
}

// ----------------------------------------------------------------------------------------- zoom

constexpr double kZoomPeriod = 96;  // frames back and forth
constexpr double kDrive = 2.6;      // scene units to each side of the center
constexpr double kZoom = 0.22;      // its exp() is the largest change of focal length
constexpr double kTarget = 7.0;     // focused distance
constexpr double kZoomGround = -0.45;

CameraPose zoom_camera(double time) {
    const double swing = std::sin(2 * glm::pi<double>() / kZoomPeriod * time);
    return {at({0, 0, kDrive * swing}), 38 * std::exp(kZoom * swing), kTarget - kDrive * swing};
}

// The camera drives down an alley while zooming in: radial motion, larger for closer objects. Focal
// length and focus distance change every frame. The sky has no depth and no motion vectors although
// the zoom moves it, as in any render of this convention.
SceneModel make_zoom() {
    SceneModel scene;
    scene.camera = zoom_camera;
    scene.lens.f_stop = 0.5;
    scene.lens.far_clip = 100;
    scene.light = {0.7, 0.7, -0.5};
    scene.light_strength = 2.4;
    Random random(5);

    scene.add(patterned(
        rectangle(30, 45, still(at({0, kZoomGround, 40}, turn({1, 0, 0}, 0.5 * glm::pi<double>()))),
                  {0.26, 0.21, 0.16}),
        SCENE_TILES, 0.5, {0.11, 0.095, 0.09}));

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
            scene.add(patterned(
                box({0.15, 0.12, 0.15}, still(at({x, kZoomGround + 0.12, z})), {0.42, 0.40, 0.37}),
                SCENE_CHECKER, 0.06, {0.25, 0.24, 0.23}));
            scene.add(patterned(rod(0.42, 0.07, still(at({x, 0.25, z})), color), SCENE_CHECKER,
                                0.14, {0.70, 0.68, 0.62}));
            scene.add(lamp(0.05, still(at({x, 0.80, z})), 16));
        }
    }
    for (int i = 0; i < 3; ++i) {
        scene.add(
            patterned(torus(0.75, 0.05, still(at({0, 0.28, 5.6 + 4.4 * i})), colors[(i + 2) % 5]),
                      SCENE_TREAD, 24, {0.75, 0.72, 0.68}));
    }
    for (int i = 0; i < 26; ++i) {
        const double z = random.between(3.6, 16), radius = random.between(0.04, 0.14);
        const double side = i % 2 ? 1.0 : -1.0;
        scene.add(glossy(
            sphere(radius, still(at({side * random.between(0.28, 0.85), kZoomGround + radius, z})),
                   colors[i % 5]),
            1.2));
    }
    for (int i = 0; i < 16; ++i) {
        const double side = i % 2 ? 1.0 : -1.0, z = 5 + 1.9 * (i / 2);
        const double half_height = random.between(0.4, 1.15);
        scene.add(patterned(
            box({0.6, half_height, 0.8},
                still(at({side * random.between(2.3, 3.0), kZoomGround + half_height, z})),
                0.04 + 0.7 * colors[(i + i / 2) % 5]),
            SCENE_WINDOWS, 0.22, {0.03, 0.04, 0.06}, {double(i), 9}));
    }
    scene.add_sign(0.40, 0.20, still(at({0, 0.30, kTarget})), {0.70, 0.52, 0.05},
                   {0.03, 0.03, 0.03}, {"ZOOM", "96 FRAMES"});
    scene.objects.back().casts = true;
    scene.add(wire({-0.32, kZoomGround, kTarget + 0.02}, {-0.32, 0.45, kTarget + 0.02}, 0.02,
                   {0.3, 0.3, 0.32}));
    scene.add(wire({0.32, kZoomGround, kTarget + 0.02}, {0.32, 0.45, kTarget + 0.02}, 0.02,
                   {0.3, 0.3, 0.32}));
    return scene;
}

// ---------------------------------------------------------------------------------------- still

// Static scene: every motion vector is exactly zero. Depths from 0.6 to 20 and a sky, to isolate
// lens effects and to test elision of motion blur.
SceneModel make_still() {
    SceneModel scene;
    constexpr double kTable = -0.17;
    scene.camera = [](double) {
        return CameraPose{at({0, 0.10, 0}, turn({1, 0, 0}, 0.10)), 50, 1.5};
    };
    scene.lens.f_stop = 1.4;
    scene.light = {-0.6, 0.8, -0.5};
    scene.light_strength = 2.2;
    Random random(3);

    scene.add(patterned(
        rectangle(1.6, 1.3, still(at({0, kTable, 1.7}, turn({1, 0, 0}, 0.5 * glm::pi<double>()))),
                  {0.36, 0.20, 0.09}),
        SCENE_TILES, 0.1, {0.16, 0.07, 0.03}));
    scene.add(patterned(
        rectangle(40, 30, still(at({0, -1.2, 30}, turn({1, 0, 0}, 0.5 * glm::pi<double>()))),
                  {0.07, 0.22, 0.02}),
        SCENE_TILES, 0.8, {0.10, 0.27, 0.03}));

    const glm::dvec3 colors[] = {{0.66, 0.02, 0.012}, {0.02, 0.22, 0.62}, {0.72, 0.42, 0.015},
                                 {0.02, 0.40, 0.05},  {0.45, 0.04, 0.48}, {0.70, 0.68, 0.64}};
    for (int i = 0; i < 7; ++i) {
        const double z = 0.75 * std::pow(1.27, i), x = -0.30 * z + 0.10 * z * i;
        scene.add(glossy(sphere(0.062, still(at({x, kTable + 0.062, z})), colors[i % 6]), 0.8));
        scene.add(patterned(box({0.05, 0.05, 0.05},
                                still(at({0.32 * z - 0.105 * z * i, kTable + 0.05, z * 1.12},
                                         turn({0, 1, 0}, 0.4 + 0.5 * i))),
                                colors[(i + 2) % 6]),
                            SCENE_CHECKER, 0.025, {0.72, 0.70, 0.66}));
    }
    scene.add(glossy(torus(0.14, 0.025, still(at({0.0, kTable + 0.165, 1.5}, turn({0, 1, 0}, 0.5))),
                           {0.75, 0.42, 0.05}),
                     0.9));
    for (int i = 0; i < 5; ++i) {
        const double x = -0.22 + 0.11 * i, z = 0.62 + 0.55 * i;
        scene.add(wire({x, kTable, z}, {x, 0.34, z}, 0.004, {0.2, 0.2, 0.22}));
        scene.add(lamp(0.008, still(at({x, 0.30 - 0.03 * i, z - 0.01})), 26));
    }
    for (int i = 0; i < 24; ++i) {
        const double z = random.between(6, 20), x = random.between(-0.45, 0.45) * z;
        const double height = random.between(0.5, 1.2);
        scene.add(wire({x, -1.2, z}, {x, -1.2 + height, z}, 0.05, {0.16, 0.10, 0.06}));
        scene.add(glossy(sphere(random.between(0.35, 0.7), still(at({x, -1.0 + height, z})),
                                {0.04, random.between(0.18, 0.34), 0.02}),
                         0.1));
        if (i % 3 == 0)
            scene.add(lamp(0.05, still(at({x + 0.3, -0.4 + 0.3 * height, z - 0.8})), 30));
    }
    return scene;
}

}  // namespace

const std::vector<SceneInfo>& scenes() {
    static const std::vector<SceneInfo> all = {
        {"wheels", "three spoked wheels turning at three depths, the center one in focus",
         make_wheels},
        {"poles", "thin poles and wires, static and swinging, during a fast pan over a city",
         make_poles},
        {"crossing",
         "solids crossing at 6 to 88 px/frame (at 640 px), one half transparent, "
         "and a hole with alpha 0",
         make_crossing},
        {"zoom", "the camera drives and zooms into an alley under a sky: radial motion", make_zoom},
        {"still", "nothing moves: depths from 0.6 to 20 and a sky", make_still},
    };
    return all;
}

}  // namespace postchain::scenes
