// Motion blur after Guertin, McGuire, Nowrouzezahrai: "A Fast and Stable Feature-Aware Motion Blur
// Filter", NVIDIA NVR-2013-003, in the notation of McGuire et al. 2012. docs/motion_blur.md says
// how each ambiguity of the report is resolved.
#pragma once

#include "chain/pass/pass.h"
#include "passes/inverse_warp/inverse_warp.h"

namespace postchain::motion_blur {

enum class Mode { guertin, single, inverse_warp };
enum class SampleSplit { even, variance };
enum class Border { skip, clamp };
enum class StaticDirection { perpendicular, dominant };
enum class VelocityStorage { automatic, fp16, fp32, unorm8 };  // automatic: none

struct Parameters : inverse_warp::Parameters {
    // Without a lens there is little noise.
    Parameters() { denoise = false; }

    Mode mode = Mode::inverse_warp;
    double jitter = 0.95;
    bool tile_jitter = true;
    double tile_jitter_slope = 1;
    double center_weight = 40;
    double variance_threshold_px = 1.5;
    double depth_softness = 1;
    SampleSplit sample_split = SampleSplit::even;
    Border border = Border::skip;
    StaticDirection static_direction = StaticDirection::perpendicular;
    double min_speed_px = 0.5;
    VelocityStorage velocity_storage = VelocityStorage::automatic;
};

// Its own rules of elision, for blocks that the device finds.
inline constexpr const char* kRuleStillBlocks = "still_blocks";
inline constexpr const char* kRuleSkyBlocks = "sky_blocks";

// Reads color, motion and (unless depth_softness is 0) inverse_depth; writes color and, if a later
// pass reads it, hint.
const PassType& pass_type();

}  // namespace postchain::motion_blur
