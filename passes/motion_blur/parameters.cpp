#include "passes/motion_blur/parameters.h"

#include <algorithm>
#include <cmath>

#include "passes/motion_blur/motion_blur.h"

namespace postchain::motion_blur {

const ParameterTable& parameter_table() {
    using P = Parameters;
    const RowValue report = {"mode", {"guertin", "single"}};
    const RowValue guertin = {"mode", {"guertin"}};
    const RowValue warp = {"mode", {"inverse_warp"}};
    const RowValue noise = {"noise", {"none"}, true};
    const RowValue time_jitter = {"time_jitter", {"0"}, true};
    const RowValue jitter = {"jitter", {"0"}, true};
    const RowValue tile_jitter = {"tile_jitter", {"true"}};
    static const ParameterTable table =
        ParameterTableBuilder<P>()
            .choice("mode", &P::mode, {"guertin", "single", "inverse_warp"},
                    {.help = "guertin: the 2013 report's filter; single: every tap along the "
                             "dominant direction, for comparison; inverse_warp: the surface seen "
                             "at the pixel at each shutter time"})
            .integer("samples", &P::samples,
                     {.min = 1,
                      .max = 1023,
                      .soft_max = 33,
                      .odd = true,
                      .unit = "taps",
                      .help = "taps of the gather per pixel; inverse_warp: largest number of time "
                              "samples",
                      .convergence = Convergence::set,
                      .converged = 401})
            .integer("max_blur_px", &P::max_blur_px,
                     {.min = 1,
                      .max = 1024,
                      .soft_max = 64,
                      .unit = "px",
                      .help = "largest half-length of a streak; guertin, single: also the edge "
                              "of a tile",
                      .unset_means = std::string(inverse_warp::kDefaultMaxPathText) +
                                     "; guertin, single: a sixteenth"})
            .rows(&P::shutter, shutter::parameter_table())
            .number("jitter", &P::jitter,
                    {.min = 0,
                     .max = 1,
                     .soft_min = 0.01,
                     .unit = "tap spacings",
                     .help = "largest shift of a pixel's taps along the streak, either way",
                     .read_if = {{report, noise}}})
            .boolean("tile_jitter", &P::tile_jitter,
                     {.help = "near a tile border, take the neighboring tile's direction at "
                              "random, which hides the tile grid",
                      .read_if = {{report, noise}}})
            .number("tile_jitter_slope", &P::tile_jitter_slope,
                    {.min = 0,
                     .max = 100,
                     .soft_max = 5,
                     .unit = "1/tile",
                     .help = "how fast the probability of the neighboring tile falls from 0.5 "
                             "with the distance to the border",
                     .read_if = {{report, noise, tile_jitter}}})
            .number("center_weight", &P::center_weight,
                    {.min = 0.1,
                     .max = 10000,
                     .soft_max = 1000,
                     .help = "kappa: the pixel's own color weighs samples / (kappa max(|v|, 0.5 "
                             "px)); larger is blurrier",
                     .read_if = {{report}}})
            .number("variance_threshold_px", &P::variance_threshold_px,
                    {.min = 0.01,
                     .max = 100,
                     .soft_max = 10,
                     .unit = "px",
                     .help = "gamma: half-velocities from 0.5 px to this much more fade from the "
                             "static direction to their own",
                     .read_if = {{guertin}}})
            .number("depth_softness", &P::depth_softness,
                    {.min = 0,
                     .max = 100,
                     .soft_min = 0.01,
                     .soft_max = 30,
                     .help = "s: how fast a surface becomes occluded with the ratio of depths; 1 "
                             "is the report, 20 a hard edge, 0 ignores depth",
                     .read_if = {{report}}})
            .choice("sample_split", &P::sample_split, {"even", "variance"},
                    {.help = "taps that follow the pixel's own velocity: every second, or more if "
                             "directions around the tile vary more",
                     .read_if = {{guertin}}})
            .rows(&P::noise, noise::parameter_table(),
                  {{report, jitter}, {report, tile_jitter}, {warp, time_jitter}})
            .choice("border", &P::border, {"skip", "clamp"},
                    {.help = "taps outside the frame: dropped, or moved to the border",
                     .read_if = {{report}}})
            .choice("static_direction", &P::static_direction, {"perpendicular", "dominant"},
                    {.help = "direction of the second half of the taps at a slow pixel: across "
                             "the dominant motion, or along it",
                     .read_if = {{guertin}}})
            .number("min_speed_px", &P::min_speed_px,
                    {.min = 0,
                     .max = 100,
                     .soft_max = 3,
                     .unit = "px",
                     .help = "half-velocity up to which a tile or block is left unchanged"})
            .rows(&P::search, inverse_warp::parameter_table(), {{warp}})
            .number("path_px_per_time", &P::path_px_per_time,
                    {.min = 0.1,
                     .max = 1000,
                     .soft_max = 8,
                     .unit = "px",
                     .help = "pixels of the longest path in a block per time sample; at least 5 "
                             "time samples, at most samples",
                     .read_if = {{warp}},
                     .convergence = Convergence::set,
                     .converged = 0.1})
            .number("time_jitter", &P::time_jitter,
                    {.min = 0,
                     .max = 1,
                     .unit = "spacings",
                     .help = "random spread of a pixel's time samples; 0 shows steps in long "
                             "streaks, 1 noise",
                     .read_if = {{warp, noise}}})
            .choice("velocity_storage", &P::velocity_storage, {"auto", "fp16", "fp32", "unorm8"},
                    {.help = "storage of half-velocities: auto stores none and reads the motion, "
                             "unorm8 is the report's encoding, for comparison",
                     .read_if = {{report}}})
            .table();
    return table;
}

int tile_px(const Parameters& parameters, const FrameDescription& frame) {
    if (const auto limit = shutter::limit_px(parameters.shutter, parameters.max_blur_px, frame))
        return std::clamp(int(std::lround(*limit)), least_tile_px(parameters), 1024);
    return std::clamp((frame.display_width + 8) / 16, kMinTilePx, 512);
}

int least_tile_px(const Parameters& parameters) {
    if (parameters.shutter.max_blur_fraction) return kMinFractionTilePx;
    return parameters.max_blur_px.value_or(kMinTilePx);
}

double max_path_px(const Parameters& parameters, const FrameDescription& frame) {
    return shutter::limit_px(parameters.shutter, parameters.max_blur_px, frame)
        .value_or(inverse_warp::default_max_path_px(frame));
}

double still_limit_px(const Parameters& parameters, int tile_px) {
    switch (parameters.velocity_storage) {
        case VelocityStorage::fp16:  // 11 significant bits per component, subnormal step 2^-24
            return parameters.min_speed_px * (1 + 0x1p-10) + 0x1p-24;
        case VelocityStorage::unorm8:  // half a step of r/127 per component, times sqrt(2)
            return parameters.min_speed_px * (1 + 0x1p-20) + 0.70711 * tile_px / 127.0;
        default:  // a few roundings of 2^-24
            return parameters.min_speed_px * (1 + 0x1p-20);
    }
}

inverse_warp::Settings warp_settings(const Parameters& parameters, const FrameDescription& frame) {
    inverse_warp::Settings settings;
    settings.shutter = {.half_open = 0.5 * shutter::open_frames(parameters.shutter, frame.camera),
                        .max_path_px = max_path_px(parameters, frame),
                        .path_px_per_time = parameters.path_px_per_time,
                        .time_jitter = parameters.time_jitter};
    settings.samples = parameters.samples;
    settings.search = parameters.search;
    settings.denoise = false;  // little noise without a lens (docs/inverse_warp.md)
    // A few roundings of 2^-24, so that motion that is still by the frame's bounds is still here
    // too.
    settings.still_limit_px = parameters.min_speed_px * (1 + 0x1p-18);
    settings.noise = parameters.noise;
    if (parameters.time_jitter == 0) settings.noise.noise = noise::Kind::none;
    settings.still_rule = kRuleStillBlocks;
    return settings;
}

bool compares_depth(const Parameters& parameters) {
    return parameters.depth_softness > 0;
}

bool splits_by_variance(const Parameters& parameters) {
    return parameters.sample_split == SampleSplit::variance && parameters.mode != Mode::single;
}

bool jitters_tiles(const Parameters& parameters) {
    return parameters.tile_jitter && parameters.noise.noise != noise::Kind::none;
}

bool jitters_taps(const Parameters& parameters) {
    return parameters.jitter > 0 && parameters.noise.noise != noise::Kind::none;
}

}  // namespace postchain::motion_blur
