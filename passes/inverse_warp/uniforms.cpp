#include "passes/inverse_warp/uniforms.h"

#include <algorithm>
#include <cmath>

#include "chain/work_list.h"
#include "passes/common/lens_samples.h"

namespace postchain::inverse_warp {

using shared::InverseWarpUniforms;

namespace {

// A sample is denoised if its displacements have at least the variance kSoftSpread (px^2; a circle
// of confusion of 4 px radius). A pixel d away has the weight exp(-window d^T covariance^-1 d); the
// window grows with the root of the samples. Lens samples are more even than random ones, with
// times they are not. Chosen by measurement (docs/inverse_warp.md).
constexpr double kSoftSpread = 8;
constexpr double kWindow = 5.7;
constexpr double kWindowWithShutter = 4.2;

// A block takes more samples if their variance, as shown, is above this. Chosen by measurement
// (docs/inverse_warp.md).
constexpr double kNoiseVariance = 0.045;

}  // namespace

bool holds_motion(const Settings& settings, const PlanContext& context) {
    return settings.shutter || !searched_neighbors(settings, context.available).empty();
}

bool uses_second_layer(const Settings& settings, const PlanContext& context) {
    const bool given_hint =
        !settings.shutter && context.available.has(Role::hint) && context.wanted.has(Role::hint);
    return context.available.has(Role::behind) && !given_hint;
}

bool holds_motion_back(const Settings& settings, const PlanContext& context) {
    return holds_motion(settings, context) && context.available.has(Role::motion_back);
}

// A surface of a block may differ by a tenth from those that its block has chosen (starts.comp).
int ring_of(double longest_px) {
    return int(std::ceil((1.1 * longest_px + 1) / kBlockPx)) + 1;
}

double longest_px(const Settings& settings) {
    return (settings.shutter ? settings.shutter->max_path_px : 0) +
           (settings.lens ? settings.lens->coc.max_radius_px : 0);
}

double longest_px(const Settings& settings, const FrameDescription& frame, bool back) {
    const FrameBounds& bounds = frame.bounds;
    double longest = 0;
    if (settings.shutter) {
        const double half_open = settings.shutter->half_open;
        // With a closed shutter nothing moves, however fast; infinity is an unknown speed.
        const double path = half_open > 0 ? half_open * bounds.fastest_px(back) : 0;
        // a and b are rounded by up to 2^-20 of them, and a step of 1/64 px.
        longest = std::min(path * (1 + 1e-5) + 0.05, settings.shutter->max_path_px);
    }
    if (settings.lens)
        longest += settings.lens->coc.largest_radius_px(bounds.min_inverse_depth,
                                                        bounds.max_inverse_depth) +
                   0.05;
    return std::min(longest, longest_px(settings));
}

InverseWarpUniforms uniforms_of(const Settings& settings, const FrameDescription& frame) {
    const auto blocks = groups_for(frame.width, frame.height);
    InverseWarpUniforms uniforms{};
    uniforms.size = {frame.width, frame.height};
    uniforms.blocks = {blocks[0], blocks[1]};
    uniforms.starts = settings.search.starts;
    uniforms.samples = settings.samples;
    uniforms.fill_layer = frame.fill_layer;
    uniforms.half_shutter = 1;
    uniforms.max_path_px = 1e15f;
    uniforms.still_limit_px = float(settings.still_limit_px);
    uniforms.soft_spread = float(kSoftSpread);
    uniforms.denoise_window = float((settings.shutter ? kWindowWithShutter : kWindow) *
                                    std::sqrt(double(settings.samples)));
    if (settings.shutter) {
        uniforms.half_shutter = float(settings.shutter->half_open);
        uniforms.max_path_px = float(settings.shutter->max_path_px);
        uniforms.time_jitter = float(settings.shutter->time_jitter);
        uniforms.path_px_per_time = float(settings.shutter->path_px_per_time);
    }
    if (settings.lens) {
        lens::set_uniforms(settings.lens->coc, uniforms);
        const double barrel = lens::barrel_per_px(settings.lens->aperture, frame);
        uniforms.barrel_per_px = float(barrel);
        uniforms.barrel_scale = float(1 - barrel * settings.lens->coc.radius_px(0));
        uniforms.center_x = float(0.5 * (frame.display_width - 1) - frame.origin_x);
        uniforms.center_y = float(0.5 * (frame.display_height - 1) - frame.origin_y);
        uniforms.pixel_axis_x = float(settings.lens->aperture.axes[0]);
        uniforms.pixel_axis_y = float(settings.lens->aperture.axes[1]);
        uniforms.lens_sets = lens::sets_of(settings.samples + settings.more_samples);
        uniforms.more_samples = settings.more_samples;
        // Halves of n samples of variance v: their means differ by 4 v/n in the mean square.
        uniforms.noise_limit = float(4 * kNoiseVariance / settings.samples);
    }
    return uniforms;
}

}  // namespace postchain::inverse_warp
