#include "tools/measure/scenes/still.h"

#include <cmath>
#include <glm/gtc/constants.hpp>

namespace postchain::scenes {

SceneModel make_still() {
    SceneModel scene;
    constexpr double kTable = -0.17;
    scene.camera = [](double) {
        return CameraPose{at({0, 0.10, 0}, turn({1, 0, 0}, 0.10)), 50, 1.5};
    };
    scene.f_stop = 1.4;
    scene.light = {-0.6, 0.8, -0.5};
    scene.light_strength = 2.2;
    Random random(3);

    Object table =
        rectangle(1.6, 1.3, still(at({0, kTable, 1.7}, turn({1, 0, 0}, 0.5 * glm::pi<double>()))),
                  {0.36, 0.20, 0.09});
    table.pattern = SCENE_TILES;
    table.cell = 0.1;
    table.color_b = {0.16, 0.07, 0.03};
    scene.objects.push_back(table);
    Object meadow =
        rectangle(40, 30, still(at({0, -1.2, 30}, turn({1, 0, 0}, 0.5 * glm::pi<double>()))),
                  {0.07, 0.22, 0.02});
    meadow.pattern = SCENE_TILES;
    meadow.cell = 0.8;
    meadow.color_b = {0.10, 0.27, 0.03};
    scene.objects.push_back(meadow);

    const glm::dvec3 colors[] = {{0.66, 0.02, 0.012}, {0.02, 0.22, 0.62}, {0.72, 0.42, 0.015},
                                 {0.02, 0.40, 0.05},  {0.45, 0.04, 0.48}, {0.70, 0.68, 0.64}};
    for (int i = 0; i < 7; ++i) {
        const double z = 0.75 * std::pow(1.27, i), x = -0.30 * z + 0.10 * z * i;
        Object ball = sphere(0.062, still(at({x, kTable + 0.062, z})), colors[i % 6]);
        ball.gloss = 0.8;
        scene.objects.push_back(ball);
        Object block = box({0.05, 0.05, 0.05},
                           still(at({0.32 * z - 0.105 * z * i, kTable + 0.05, z * 1.12},
                                    turn({0, 1, 0}, 0.4 + 0.5 * i))),
                           colors[(i + 2) % 6]);
        block.pattern = SCENE_CHECKER;
        block.cell = 0.025;
        block.color_b = {0.72, 0.70, 0.66};
        scene.objects.push_back(block);
    }
    Object ring = torus(0.14, 0.025, still(at({0.0, kTable + 0.165, 1.5}, turn({0, 1, 0}, 0.5))),
                        {0.75, 0.42, 0.05});
    ring.gloss = 0.9;
    scene.objects.push_back(ring);
    for (int i = 0; i < 5; ++i) {
        const double x = -0.22 + 0.11 * i, z = 0.62 + 0.55 * i;
        scene.objects.push_back(wire({x, kTable, z}, {x, 0.34, z}, 0.004, {0.2, 0.2, 0.22}));
        scene.objects.push_back(lamp(0.008, still(at({x, 0.30 - 0.03 * i, z - 0.01})), 26));
    }
    for (int i = 0; i < 24; ++i) {
        const double z = random.between(6, 20), x = random.between(-0.45, 0.45) * z;
        const double height = random.between(0.5, 1.2);
        scene.objects.push_back(
            wire({x, -1.2, z}, {x, -1.2 + height, z}, 0.05, {0.16, 0.10, 0.06}));
        Object crown = sphere(random.between(0.35, 0.7), still(at({x, -1.0 + height, z})),
                              {0.04, random.between(0.18, 0.34), 0.02});
        crown.gloss = 0.1;
        scene.objects.push_back(crown);
        if (i % 3 == 0)
            scene.objects.push_back(
                lamp(0.05, still(at({x + 0.3, -0.4 + 0.3 * height, z - 0.8})), 30));
    }
    return scene;
}

}  // namespace postchain::scenes
