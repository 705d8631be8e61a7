#include "tests/scenes/support.h"

#include "tests/support/moments.h"
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
    const auto m = postchain::test::moments_of(image, -0.5, -0.5);
    return {m.light, m.x, m.y, m.xx - m.x * m.x, m.yy - m.y * m.y};
}

}  // namespace postchain::scenes::test
