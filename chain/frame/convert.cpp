#include "chain/frame/convert.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "shaders/shared/color_limits.h"

namespace postchain {
namespace {

using shared::kMaxColor;
using shared::kMaxHalf;

bool finite(float value) {
    return (std::bit_cast<uint32_t>(value) & 0x7f800000u) != 0x7f800000u;
}

// Results of the walk: bounds, and faults of the input.
class Findings {
  public:
    Findings(FrameBounds& of_frame, int width) : bounds(of_frame), width_(width) {}
    void nonfinite(uint64_t& count, size_t pixel) {
        ++count;
        if (pixel >= first_) return;
        first_ = pixel;
        health.first_nonfinite = {int(pixel % size_t(width_)), int(pixel / size_t(width_))};
    }

    FrameBounds& bounds;
    InputHealth health;

  private:
    int width_;
    size_t first_ = size_t(-1);
};

// Results of one walk over the colors. Written so that it vectorizes.
struct ColorScan {
    std::array<float, 4> low = {}, high = {};
    bool finite = true;  // every value can be averaged
    bool negative_zero = false;
    bool plainly_half = true;  // no bit that a half lacks, and no value below 2^-14 but 0
};

ColorScan scan(const ImageF& color) {
    ColorScan found;
    if (color.empty()) return found;
    std::copy_n(color.data.data(), 4, found.low.begin());
    found.high = found.low;
    uint32_t nonfinite = 0, negative_zero = 0, odd = 0;
    for (size_t at = 0; at < color.data.size(); at += 4) {
        for (size_t c = 0; c < 4; ++c) {
            const float value = color.data[at + c];
            const uint32_t bits = std::bit_cast<uint32_t>(value);
            const uint32_t size = bits & 0x7fffffffu;
            found.low[c] = value < found.low[c] ? value : found.low[c];
            found.high[c] = value > found.high[c] ? value : found.high[c];
            nonfinite |= uint32_t(size > std::bit_cast<uint32_t>(kMaxColor));
            negative_zero |= uint32_t(bits == 0x80000000u);
            odd |= (bits & 0x1fffu) | uint32_t(size > 0x477fe000u) |  // 65504
                   uint32_t(size - 1u < 0x387fffffu);                 // 2^-14, but not 0
        }
    }
    found.finite = nonfinite == 0;
    found.negative_zero = negative_zero != 0;
    found.plainly_half = odd == 0;
    return found;
}

bool is_half(float value) {
    const uint32_t size = std::bit_cast<uint32_t>(value) & 0x7fffffffu;
    if (size >= 0x38800000u) return (size & 0x1fffu) == 0 && size <= 0x477fe000u;
    return value * 0x1p24f == std::nearbyint(value * 0x1p24f);  // a subnormal half
}

// `frame_pixels`: of one of the planes stacked in `color`.
void replace_nonfinite(ImageF& color, const ConvertOptions& options, size_t frame_pixels,
                       Findings& findings) {
    for (size_t pixel = 0; pixel < color.pixels(); ++pixel) {
        float* rgba = color.data.data() + 4 * pixel;
        bool bad = false;
        for (int c = 0; c < 4; ++c) {
            if (std::abs(rgba[c]) <= kMaxColor) continue;
            bad = true;
            const bool clamp =
                options.nonfinite_color == NonfiniteColor::clamp && !std::isnan(rgba[c]);
            rgba[c] = clamp ? std::copysign(kMaxHalf, rgba[c]) : 0.0f;
        }
        if (bad) findings.nonfinite(findings.health.nonfinite_color, pixel % frame_pixels);
    }
}

void premultiply(ImageF& color) {
    for (size_t pixel = 0; pixel < color.pixels(); ++pixel) {
        float* rgba = color.data.data() + 4 * pixel;
        for (int c = 0; c < 3; ++c) rgba[c] *= rgba[3];
    }
}

void convert_color(ImageF& color, const ConvertOptions& options, Findings& findings) {
    if (options.unpremultiplied) premultiply(color);
    ColorScan found = scan(color);
    if (!found.finite) {
        replace_nonfinite(color, options, color.pixels(), findings);
        found = scan(color);
    }
    std::copy(found.low.begin(), found.low.end(), findings.bounds.min_color.begin());
    std::copy(found.high.begin(), found.high.end(), findings.bounds.max_color.begin());
    findings.bounds.one_color = found.finite && found.low == found.high && !found.negative_zero;
    findings.bounds.color_is_half =
        found.plainly_half || std::all_of(color.data.begin(), color.data.end(), is_half);
}

// Every layer of a stack. As color is stored without its alpha, so are they.
void convert_layers(ImageF& layers, const ImageF& color, const ConvertOptions& options,
                    Findings& findings) {
    for (size_t pixel = 0; options.unpremultiplied && pixel < layers.pixels(); ++pixel)
        for (size_t c = 0; c < 3; ++c)
            layers.data[4 * pixel + c] *= color.data[4 * (pixel % color.pixels()) + 3];
    const ColorScan found = scan(layers);
    if (!found.finite) replace_nonfinite(layers, options, color.pixels(), findings);
    findings.bounds.layers_are_half = (found.finite && found.plainly_half) ||
                                      std::all_of(layers.data.begin(), layers.data.end(), is_half);
}

// 1/d as an affine function of the stored depth: 1/d = offset + slope * z.
struct AffineDepth {
    double offset = 0;
    double slope = 1;
};

Result<AffineDepth> affine_depth(DepthEncoding encoding, const Camera& camera) {
    const auto fault = [](const char* text) { return Status(StatusCode::chain, text); };
    if (!camera.near_clip || *camera.near_clip <= 0)
        return fault(
            "camera.near_clip: must be > 0 for a depth-buffer encoding; give the near "
            "clip plane in the camera");
    const double n = 1 / *camera.near_clip;
    const bool bounded = encoding == DepthEncoding::forward || encoding == DepthEncoding::reverse;
    if (bounded && (!camera.far_clip || *camera.far_clip <= *camera.near_clip))
        return fault("camera.far_clip: must be > near_clip for this depth-buffer encoding");
    const double f = bounded ? 1 / *camera.far_clip : 0;
    switch (encoding) {
        case DepthEncoding::forward:
        case DepthEncoding::forward_infinite:
            return AffineDepth{n, f - n};
        default:
            return AffineDepth{f, n - f};
    }
}

Status convert_depth(ImageF& depth, const FrameDescription& frame, const ConvertOptions& options,
                     Findings& findings) {
    AffineDepth affine;
    double f_px = 1;
    const bool distance =
        options.depth == DepthEncoding::linear || options.depth == DepthEncoding::ray_distance;
    if (options.depth == DepthEncoding::ray_distance) {
        if (!frame.camera.focal_length_mm || !frame.camera.sensor_width_mm)
            return Status(StatusCode::chain,
                          "camera.focal_length_mm, camera.sensor_width_mm: needed to turn ray "
                          "distance into depth; give them in the camera");
        f_px = *frame.camera.focal_length_mm * frame.display_width / *frame.camera.sensor_width_mm;
    } else if (!distance && options.depth != DepthEncoding::inverse) {
        ASSIGN_OR_RETURN(affine, affine_depth(options.depth, frame.camera));
    }
    constexpr float kNone = std::numeric_limits<float>::infinity();
    float low = kNone, lowest_surface = kNone, high = 0;
    for (size_t pixel = 0; pixel < depth.data.size(); ++pixel) {
        float& value = depth.data[pixel];
        float w = 0;
        if (!finite(value)) {
            // +Inf is a usual way to write "empty" as a distance; NaN never is.
            if (!distance || value != std::numeric_limits<float>::infinity())
                findings.nonfinite(findings.health.nonfinite_depth, pixel);
        } else if (distance) {
            double d = value;
            if (options.depth == DepthEncoding::ray_distance) {
                const double x = frame.origin_x + double(pixel % size_t(depth.width)) + 0.5 -
                                 0.5 * frame.display_width;
                const double y = (frame.origin_y + double(pixel / size_t(depth.width)) + 0.5 -
                                  0.5 * frame.display_height) /
                                 frame.pixel_aspect;
                d *= f_px / std::sqrt(x * x + y * y + f_px * f_px);
            }
            if (d > 0)
                w = float(1 / d);
            else
                ++findings.health.negative_depth;
            if (!finite(w)) w = std::numeric_limits<float>::max();  // d below 2^-128
        } else {
            w = float(affine.offset + affine.slope * double(value));
            if (w < 0) {
                w = 0;
                ++findings.health.negative_depth;
            }
        }
        value = w;
        low = std::min(low, w);
        high = std::max(high, w);
        if (!is_infinitely_far(w)) lowest_surface = std::min(lowest_surface, w);
    }
    findings.health.farthest_surface = 1 / double(lowest_surface);  // 0: there is none
    findings.bounds.min_inverse_depth = depth.empty() ? 0 : double(low);
    findings.bounds.max_inverse_depth = double(high);
    return Status();
}

void convert_motion(ImageF& motion, const MotionConvention& convention,
                    const FrameDescription& frame, bool forward, Findings& findings) {
    const bool fraction = convention.unit == MotionUnit::fraction;
    const float scale_x = float(convention.scale_x * (fraction ? frame.display_width : 1));
    const float scale_y = float(convention.scale_y * (fraction ? frame.display_height : 1));
    const float bias = float(convention.bias);
    const float sentinel = float(convention.sentinel);
    double largest = 0;
    bool in_0_1 = true;
    for (size_t pixel = 0; pixel < motion.pixels(); ++pixel) {
        float* v = motion.data.data() + 2 * pixel;
        if (finite(v[0]) && finite(v[1]) &&
            (std::abs(v[0]) >= sentinel || std::abs(v[1]) >= sentinel)) {
            v[0] = v[1] = 0;
            if (forward) ++findings.health.sentinel_motion;
            continue;
        }
        in_0_1 = in_0_1 && !(std::min(v[0], v[1]) < 0) && !(std::max(v[0], v[1]) > 1);
        float x = scale_x * (v[0] - bias), y = scale_y * (v[1] - bias);
        if (!finite(x) || !finite(y)) {
            x = y = 0;
            findings.nonfinite(findings.health.nonfinite_motion, pixel);
        }
        v[0] = x;
        v[1] = y;
        largest = std::max(largest, double(x) * double(x) + double(y) * double(y));
    }
    if (!forward) {
        findings.bounds.max_speed_back_px = std::sqrt(largest);
        return;
    }
    findings.bounds.max_speed_px = std::sqrt(largest);
    findings.health.motion_all_zero = largest == 0;
    findings.health.motion_in_0_1 = in_0_1;
    findings.health.fastest_stored_px = std::sqrt(largest);
}

}  // namespace

ImageD finite_color(ImageD color) {
    for (double& value : color.data) {
        if (std::isnan(value)) value = 0;
        if (std::abs(value) > double(kMaxColor)) value = std::copysign(double(kMaxHalf), value);
    }
    return color;
}

Result<InputHealth> convert_frame(FramePlanes& planes, FrameDescription& frame,
                                  const ConvertOptions& options) {
    if (planes.empty()) return Status(StatusCode::input, "the frame has no planes");
    frame.width = planes.begin()->second.width;
    frame.height = planes.begin()->second.height;
    frame.planes = {};
    const bool camera_cut = frame.bounds.camera_cut;
    frame.bounds = {};
    frame.bounds.camera_cut = camera_cut;
    frame.layers = 0;
    for (const auto& [role, plane] : planes) {
        const bool stack = is_stacked(role) && frame.height > 0 && plane.height > 0 &&
                           plane.height % frame.height == 0;
        if (plane.width != frame.width || (plane.height != frame.height && !stack))
            return Status(StatusCode::input,
                          concat(name_of(role), " is ", plane.width, "x", plane.height, ", ",
                                 name_of(planes.begin()->first), " is ", frame.width, "x",
                                 frame.height, "; planes of one frame must have one size"));
        if (plane.channels != channels_of(role))
            return Status(StatusCode::input, concat(name_of(role), " has ", plane.channels,
                                                    " channels, needs ", channels_of(role)));
        frame.planes.add(role);
        if (role == Role::layers) frame.layers = plane.height / frame.height;
    }
    Findings findings(frame.bounds, frame.width);
    for (auto& [role, plane] : planes) {
        switch (role) {
            case Role::color:
                convert_color(plane, options, findings);
                break;
            case Role::inverse_depth:
                RETURN_IF_ERROR(convert_depth(plane, frame, options, findings));
                break;
            case Role::motion:
                convert_motion(plane, options.motion, frame, true, findings);
                break;
            case Role::motion_back:
                convert_motion(plane, options.motion_back, frame, false, findings);
                break;
            case Role::layers:
                if (planes.count(Role::color))
                    convert_layers(plane, planes.at(Role::color), options, findings);
                break;
            default:  // planes that files do not have; a neighbor's were converted with it
                break;
        }
    }
    return findings.health;
}

}  // namespace postchain
