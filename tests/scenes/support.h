// A renderer shared by all tests of this folder, and small models with known results.
#pragma once

#include <gtest/gtest.h>

#include "tools/scenes/renderer.h"
#include "tools/scenes/scene.h"

namespace postchain::scenes::test {

SceneRenderer& renderer();  // made on first use; fails the test without GL

// Fails the test if rendering fails.
ScenePlanes render(const SceneModel& model, const RenderSettings& settings);
ScenePlanes render(const std::string& scene, int width, int height, int frame, Picture picture,
                   int samples = 1, const Camera& camera = {});

// An empty scene with a camera at rest at the origin: 50 mm on 36 mm, so F = 50/36 * width pixels.
SceneModel empty_model(double focus_distance = 2, double f_stop = 2);
// A wall of radiance 1 across the view.
Object wall(PoseAt pose);
// An unlit surface of exactly this radiance.
Object unlit(Object object, glm::dvec3 radiance);

// Sum of the first channel, center and second moments about it, in pixels.
struct Moments {
    double sum = 0;
    double x = 0, y = 0;    // pixel coordinates, centers at halves
    double xx = 0, yy = 0;  // variances
};
Moments moments_of(const ImageF& image);

}  // namespace postchain::scenes::test
