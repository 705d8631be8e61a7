#include "tests/fxaa/support.h"

#include "tests/support/variants.h"

namespace postchain::test {

SettingList stored_settings(const SettingList& more) {
    SettingList settings = {{"luma", "stored"}, {"blend", "stored"}, {"hint", "none"}};
    settings.insert(settings.end(), more.begin(), more.end());
    return settings;
}

Chain fxaa_chain(const SettingList& settings) {
    return Variant{.name = "fxaa", .links = {{"fxaa", settings}}}.chain();
}

fxaa::Parameters parameters_of(const SettingList& settings) {
    return fxaa_chain(settings).links[0].pass->parameters().as<fxaa::Parameters>();
}

FramePlanes planes_of(const ImageF& color, const ImageF& hint) {
    FramePlanes planes = {{Role::color, color}};
    if (!hint.empty()) planes[Role::hint] = hint;
    return planes;
}

namespace {

// Unlike describe(), does not analyze pixels: the tests pass non-finite ones on purpose.
FrameDescription description_of(const FramePlanes& planes) {
    FrameDescription frame;
    frame.width = frame.display_width = planes.at(Role::color).width;
    frame.height = frame.display_height = planes.at(Role::color).height;
    for (const auto& [role, plane] : planes) frame.planes.add(role);
    return frame;
}

}  // namespace

ImageF luma_on_gpu(const Chain& chain, const FrameDescription& frame, const FramePlanes& planes,
                   Precision precision) {
    Stages gpu = filter_with_stages(chain, frame, planes, {.precision = precision, .elide = false});
    return std::move(gpu.stages.at("0.fxaa.luma"));
}

ImageF run(const SettingList& settings, const ImageF& color, const ImageF& hint) {
    const FramePlanes planes = planes_of(color, hint);
    return filter(fxaa_chain(settings), description_of(planes), planes, {.elide = false})
        .at(Role::color);
}

ImageF constant_hint(int width, int height, float tile, float pixel) {
    return constant_image(width, height, {tile, pixel});
}

ImageF slanted_edge(int width, int height, double slope, double offset, double low, double high,
                    int samples) {
    return gray_image(width, height, [&](int x, int y) {
        int below = 0;
        for (int j = 0; j < samples; ++j)
            for (int i = 0; i < samples; ++i)
                below += y + (j + 0.5) / samples > offset + slope * (x + (i + 0.5) / samples);
        return low + (high - low) * below / (samples * samples);
    });
}

}  // namespace postchain::test
