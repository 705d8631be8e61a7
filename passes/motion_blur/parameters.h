// Parameters of the motion blur; meaning, unit and range of each are in its table.
#pragma once

#include "chain/frame.h"
#include "chain/parameter.h"
#include "passes/common/noise.h"
#include "passes/common/shutter.h"
#include "passes/inverse_warp/inverse_warp.h"

namespace postchain::motion_blur {

enum class Mode { guertin, single, inverse_warp };
enum class SampleSplit { even, variance };
enum class Border { skip, clamp };
enum class StaticDirection { perpendicular, dominant };
enum class VelocityStorage { automatic, fp16, fp32, unorm8 };  // automatic: none

struct Parameters {
    Mode mode = Mode::inverse_warp;
    int samples = 25;
    std::optional<int> max_blur_px;
    shutter::Parameters shutter;
    double jitter = 0.95;
    bool tile_jitter = true;
    double tile_jitter_slope = 1;
    double center_weight = 40;
    double variance_threshold_px = 1.5;
    double depth_softness = 1;
    SampleSplit sample_split = SampleSplit::even;
    noise::Parameters noise;
    Border border = Border::skip;
    StaticDirection static_direction = StaticDirection::perpendicular;
    double min_speed_px = 0.5;
    inverse_warp::Parameters search;
    double path_px_per_time = 2;
    double time_jitter = 0.25;
    VelocityStorage velocity_storage = VelocityStorage::automatic;
};

const ParameterTable& parameter_table();

// Longest half-length of a streak, pixels, of the inverse warp.
double max_path_px(const Parameters& parameters, const FrameDescription& frame);

// The limit of the report's filter, which is the edge of its tiles: the user's, or a sixteenth of
// the display width but at least kMinTilePx.
inline constexpr int kMinTilePx = 40;
inline constexpr int kMinFractionTilePx = 8;  // with max_blur_fraction
int tile_px(const Parameters& parameters, const FrameDescription& frame);
// On frames of every size.
int least_tile_px(const Parameters& parameters);

// A tile is left unblurred if |v_max| is at most this: min_speed_px plus the largest lengthening by
// storage of a half-velocity, so that motion that is still by the frame's bounds is still by its
// stored vectors too.
double still_limit_px(const Parameters& parameters, int tile_px);

// Settings of mode: inverse_warp.
inverse_warp::Settings warp_settings(const Parameters& parameters, const FrameDescription& frame);

// True if the report's filter compares depths, and splits its taps by the tiles' variance.
bool compares_depth(const Parameters& parameters);
bool splits_by_variance(const Parameters& parameters);

// True if the filter needs random numbers for tiles, and for taps.
bool jitters_tiles(const Parameters& parameters);
bool jitters_taps(const Parameters& parameters);

}  // namespace postchain::motion_blur
