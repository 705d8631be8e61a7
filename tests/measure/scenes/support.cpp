#include "tests/measure/scenes/support.h"

#include <cmath>

#include "tests/support/status.h"

namespace postchain::scenes::test {

SceneRenderer& renderer() {
    static const auto one = postchain::test::must(SceneRenderer::create());
    return *one;
}

ScenePlanes render(const SceneModel& model, const RenderSettings& settings) {
    return postchain::test::must(renderer().render(model, settings));
}

ScenePlanes render(const std::string& scene, int width, int height, int frame, Picture picture,
                   int samples, const Camera& camera) {
    SceneRequest request;
    request.name = scene;
    request.width = width;
    request.height = height;
    request.truth_samples = request.sharp_samples = samples;
    request.camera = camera;
    return postchain::test::must(render_frame(renderer(), request, frame, picture));
}

SceneModel empty_model(double focus_distance, double f_stop) {
    SceneModel model;
    model.camera = [=](double) { return CameraPose{Pose{}, 50, focus_distance}; };
    model.lens.f_stop = f_stop;
    model.background_opaque = false;
    return model;
}

Object wall(PoseAt pose) {
    return unlit(rectangle(9, 9, std::move(pose), {}), {1, 1, 1});
}

Object unlit(Object object, glm::dvec3 radiance) {
    object.color = radiance;
    object.lamp = 1;
    object.gloss = 0;
    object.casts = false;
    return object;
}

Moments moments_of(const ImageF& image) {
    Moments m;
    for (int y = 0; y < image.height; ++y)
        for (int x = 0; x < image.width; ++x) {
            const double value = image.at(x, y);
            m.sum += value;
            m.x += value * (x + 0.5);
            m.y += value * (y + 0.5);
            m.xx += value * (x + 0.5) * (x + 0.5);
            m.yy += value * (y + 0.5) * (y + 0.5);
        }
    m.x /= m.sum;
    m.y /= m.sum;
    m.xx = m.xx / m.sum - m.x * m.x;
    m.yy = m.yy / m.sum - m.y * m.y;
    return m;
}

double display(double value) {
    return std::pow(value / (1 + value), 1 / 2.2);
}

double display_rmse(const ImageF& a, const ImageF& b) {
    double sum = 0;
    for (int y = 0; y < a.height; ++y)
        for (int x = 0; x < a.width; ++x)
            for (int c = 0; c < 3; ++c)
                sum += std::pow(display(a.at(x, y, c)) - display(b.at(x, y, c)), 2);
    return std::sqrt(sum / double(3 * a.pixels()));
}

}  // namespace postchain::scenes::test
