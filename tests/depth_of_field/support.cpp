#include "tests/depth_of_field/support.h"

#include "tests/support/variants.h"

namespace postchain::test {

FramePlanes flat_planes(ImageF color, float inverse_depth) {
    ImageF depth(color.width, color.height, 1, inverse_depth);
    return planes_of(std::move(color), std::move(depth));
}

FramePlanes deep_planes(int width, int height, uint32_t seed) {
    ImageF depth(width, height, 1);
    const ImageF noise = noise_image(width, height, 1, seed + 100);
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
            float& w = depth.at(x, y);
            if (y >= height / 4) w = 0.15f + 0.2f * noise.at(x, y);  // d 2.9 .. 6.7, focus at 4
            if (x >= width / 2 && y >= height / 2) w = 0.8f;         // d 1.25
        }
    return planes_of(noise_image(width, height, 4, seed, -0.25f, 4), std::move(depth));
}

namespace {
Chain chain_with(const Settings& settings, Settings defaults = {{"method", "gilham"}}) {
    Variant::Link link = {"depth_of_field", defaults};
    link.settings.insert(link.settings.end(), settings.begin(), settings.end());
    return Variant{.name = link.type, .links = {link}}.chain();
}
}  // namespace

ImageF dof(const FramePlanes& planes, Settings settings) {
    return filter(chain_with(settings), describe_round(planes), planes, {.elide = false})
        .at(Role::color);
}

Stages dof_stages(const FramePlanes& planes, Settings settings) {
    return filter_with_stages(chain_with(settings), describe_round(planes), planes,
                              {.elide = false});
}

ReferenceFrame dof_reference(const FramePlanes& planes, Settings settings) {
    return reference(chain_with(settings), describe_round(planes), planes, {.elide = false});
}

ImageF dot(float inverse_depth, Settings settings, int x, int y, const BokehKernel& image,
           double pixel_aspect) {
    ImageF color = constant_image(97, 97, {0, 0, 0, 1});
    color.at(48, 48) = 1;
    const FramePlanes planes = flat_planes(std::move(color), inverse_depth);
    FrameDescription frame = describe_round(planes);
    frame.display_width = 6400;
    frame.display_height = 3600;
    frame.camera.sensor_width_mm = 360;
    frame.camera.aperture_image = image;
    frame.origin_x = x;
    frame.origin_y = y;
    frame.pixel_aspect = pixel_aspect;
    const Chain chain = chain_with(
        settings,
        {{"method", "inverse_warp"}, {"samples", int64_t(1023)}, {"max_radius_px", 30.0}});
    return filter(chain, frame, planes, {.elide = false}).at(Role::color);
}

std::string stage(const std::string& name) {
    return "0.depth_of_field." + name;
}

Moments moments_of(const lens::Points& points) {
    Moments m;
    m.light = double(points.packed.size());
    for (int set = 0; set < points.sets; ++set)
        for (int i = 0; i < points.count; ++i) {
            const auto [x, y] = points.at(i, set);
            m.x += x / m.light, m.y += y / m.light;
            m.xx += x * x / m.light, m.yy += y * y / m.light;
        }
    return m;
}

double sum_of(const ImageF& image, int channel) {
    double sum = 0;
    for (int y = 0; y < image.height; ++y)
        for (int x = 0; x < image.width; ++x) sum += image.at(x, y, channel);
    return sum;
}

}  // namespace postchain::test
