#include "passes/depth_of_field/gilham_reference.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "passes/common/wide_color.h"
#include "shaders/shared/sharp_radius.h"

namespace postchain::depth_of_field {
namespace {

// Scene units; infinite if focus_at is a place in the sky.
double focus_of(const lens::Parameters& p, const FrameDescription& frame) {
    if (p.coc == lens::CocSource::range && p.focus) return *p.focus;
    if (p.focus_distance) return *p.focus_distance;
    if (p.focus_at) return 1 / frame.bounds.inverse_depth_at.at(*p.focus_at);
    return frame.camera.focus_distance.value_or(0);
}

// R by the formulas of docs/depth_of_field.md. Lengths in meters for the lens; d in scene units.
double signed_radius(const lens::Parameters& p, const FrameDescription& frame, double d) {
    // In shorter sides of a pixel.
    const double display_width = frame.display_width * std::max(frame.pixel_aspect, 1.0);
    const double display_height = frame.display_height * std::max(1 / frame.pixel_aspect, 1.0);
    const double max_radius = p.max_radius_fraction
                                  ? *p.max_radius_fraction * display_height
                                  : p.max_radius_px.value_or(0.03 * display_width);
    double radius = 0;
    switch (p.coc) {
        case lens::CocSource::lens: {
            const Camera& camera = frame.camera;
            const double unit = camera.meters_per_unit.value_or(1.0);
            const double f =
                1e-3 * (p.focal_length_mm ? p.focal_length_mm : camera.focal_length_mm).value_or(0);
            const double stop = (p.f_stop ? p.f_stop : camera.f_stop).value_or(0);
            const double s = unit * focus_of(p, frame);
            const double sensor =
                1e-3 * (p.sensor_width_mm ? p.sensor_width_mm : camera.sensor_width_mm).value_or(0);
            const double depth = unit * d;  // infinite for the sky
            const double diameter =
                p.breathing
                    ? f * f / (stop * (1 - f / s)) * display_width / sensor * (1 / s - 1 / depth)
                    : f * display_width / sensor * (f / stop) * (1 / s - 1 / depth);
            radius = diameter / 2;
            break;
        }
        case lens::CocSource::planes:
            if (d < p.near_sharp)
                radius = -p.max_near_fraction * display_width *
                         std::min((p.near_sharp - d) / (p.near_sharp - p.near_blurry), 1.0);
            else if (d > p.far_sharp)
                radius = std::isinf(d)
                             ? p.max_far_fraction * display_width
                             : p.max_far_fraction * display_width *
                                   std::min((d - p.far_sharp) / (p.far_blurry - p.far_sharp), 1.0);
            break;
        case lens::CocSource::range: {
            radius = max_radius * std::clamp((d - focus_of(p, frame)) / p.range, -1.0, 1.0);
            break;
        }
    }
    if (std::isnan(radius)) radius = 0;  // 0 times infinity: an infinite f-stop at d = 0
    return std::clamp(radius, -max_radius, max_radius);
}

ImageD box_means(const ImageD& image, int factor, const std::vector<double>& weights,
                 const GilhamSizes& sizes) {
    ImageD low(sizes.low_width, sizes.low_height, image.channels);
    for (int y = 0; y < low.height; ++y)
        for (int x = 0; x < low.width; ++x) {
            double total = 0;
            std::vector<double> sum(size_t(image.channels), 0.0);
            for (int j = y * factor; j < std::min((y + 1) * factor, image.height); ++j)
                for (int i = x * factor; i < std::min((x + 1) * factor, image.width); ++i) {
                    const double weight = weights[size_t(j) * size_t(image.width) + size_t(i)];
                    total += weight;
                    for (int c = 0; c < image.channels; ++c)
                        sum[size_t(c)] += weight * image.at(i, j, c);
                }
            for (int c = 0; c < image.channels; ++c) low.at(x, y, c) = sum[size_t(c)] / total;
        }
    return low;
}

ImageD blur(const ImageD& source, const ImageD& guide, Leak leak, double sigma, int taps, int dx,
            int dy) {
    ImageD blurred(source.width, source.height, source.channels);
    for (int y = 0; y < source.height; ++y)
        for (int x = 0; x < source.width; ++x) {
            double total = 0;
            std::vector<double> sum(size_t(source.channels), 0.0);
            for (int i = -taps; i <= taps; ++i) {
                const int u = x + i * dx;
                const int v = y + i * dy;
                if (!source.inside(u, v)) continue;
                double weight = i == 0 ? 1 : std::exp(-double(i) * i / (2 * sigma * sigma));
                if (leak == Leak::depth && guide.at(u, v) > 1.02 * guide.at(x, y)) weight = 0;
                if (leak == Leak::coc && guide.at(u, v) < guide.at(x, y))
                    weight *= guide.at(u, v) / guide.at(x, y);
                total += weight;
                for (int c = 0; c < source.channels; ++c)
                    sum[size_t(c)] += weight * source.at(u, v, c);
            }
            for (int c = 0; c < source.channels; ++c) blurred.at(x, y, c) = sum[size_t(c)] / total;
        }
    return blurred;
}

double bilinear(const ImageD& image, double x, double y, int c) {
    x = std::clamp(x, 0.0, double(image.width - 1));
    y = std::clamp(y, 0.0, double(image.height - 1));
    const int x0 = int(x), y0 = int(y);
    const int x1 = std::min(x0 + 1, image.width - 1), y1 = std::min(y0 + 1, image.height - 1);
    const double s = x - x0, t = y - y0;
    return (1 - t) * ((1 - s) * image.at(x0, y0, c) + s * image.at(x1, y0, c)) +
           t * ((1 - s) * image.at(x0, y1, c) + s * image.at(x1, y1, c));
}

double smoothstep(double low, double high, double x) {
    const double t = std::clamp((x - low) / (high - low), 0.0, 1.0);
    return t * t * (3 - 2 * t);
}

}  // namespace

void gilham_reference(const Parameters& parameters, const GilhamSizes& sizes,
                      const PlanContext& context, ReferenceFrame& frame) {
    const ImageD color = wide_color(frame);
    const ImageD& inverse_depth = frame.planes.at(Role::inverse_depth);
    const int width = color.width;
    const int height = color.height;

    ImageD coc(width, height, 1);
    ImageD absolute_radius(width, height, 1);
    ImageD depth_guide(width, height, 1);
    std::vector<double> color_weights(color.pixels());
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
            const double w = inverse_depth.at(x, y) > 0 ? inverse_depth.at(x, y) : 0;
            coc.at(x, y) = signed_radius(parameters.lens, context.frame, 1 / w);
            absolute_radius.at(x, y) = std::abs(coc.at(x, y));
            depth_guide.at(x, y) = std::min(w, 1e37);
            const double* c = color.pixel(x, y);
            const double peak = std::max({c[0], c[1], c[2], 0.0});
            double& weight = color_weights[size_t(y) * size_t(width) + size_t(x)];
            weight = parameters.hdr_weight ? 1 / (1 + peak) : 1;
        }
    const ImageD small = box_means(color, sizes.factor, color_weights, sizes);
    ImageD guide;
    if (parameters.leak != Leak::none) {
        const bool by_depth = parameters.leak == Leak::depth;
        guide = box_means(by_depth ? depth_guide : absolute_radius, sizes.factor,
                          std::vector<double>(color.pixels(), 1.0), sizes);
        frame.stages[by_depth ? "small_depth" : "small_radius"] = guide;
    }
    const ImageD blur_x =
        blur(small, guide, parameters.leak, sizes.low_sigma[0], sizes.taps[0], 1, 0);
    const ImageD blur_y =
        blur(blur_x, guide, parameters.leak, sizes.low_sigma[1], sizes.taps[1], 0, 1);

    ImageD result = color;
    const bool carry_hint = context.available.has(Role::hint) && context.wanted.has(Role::hint);
    ImageD hint = carry_hint ? frame.planes.at(Role::hint) : ImageD();
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
            const double radius = std::abs(coc.at(x, y));
            const double weight = smoothstep(shared::kSharpRadiusPx, sizes.full_blur_px, radius);
            for (int c = 0; c < color.channels && weight > 0; ++c) {
                const double low = bilinear(blur_y, (x + 0.5) / sizes.factor - 0.5,
                                            (y + 0.5) / sizes.factor - 0.5, c);
                result.at(x, y, c) = (1 - weight) * color.at(x, y, c) + weight * low;
            }
            for (int c = 0; c < 2 && carry_hint; ++c)
                hint.at(x, y, c) *= std::clamp(1 - radius, 0.0, 1.0);
        }
    set_wide_color(frame, result);
    if (carry_hint) {
        frame.planes[Role::hint] = hint;
        frame.stages["hint"] = hint;
    }
    frame.stages["coc"] = coc;
    for (const auto& [name, stage] :
         {std::pair{"small", &small}, {"blur_x", &blur_x}, {"blur_y", &blur_y}}) {
        frame.stages[name] = color_of_wide(*stage);
        if (stage->channels > 4)
            frame.stages[std::string(name) + "_layers"] = layers_of_wide(*stage);
    }
    frame.stages["color"] = frame.planes.at(Role::color);
}

}  // namespace postchain::depth_of_field
