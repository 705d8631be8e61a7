// FXAA: post-process anti-aliasing of scene-linear and display-referred images.
//
// Source for mode: search: T. Lottes, FXAA 3.11, quality path; mode: directional is ours. The hint
// is from B. Guertin, M. McGuire, D. Nowrouzezahrai, NVR-2013-003. Formulas, the effect of the hint
// and the deviations: docs/fxaa.md.
#pragma once

#include <optional>
#include <vector>

#include "chain/pass/pass.h"

namespace postchain::fxaa {

enum class Mode {
    search,       // FXAA 3.11: finds both ends of an edge, moves along the nearer one's offset
    directional,  // a Gaussian, long along the edge and narrow across it
};
// The source of the luma that decides.
enum class Luma {
    stored,   // 0.299, 0.587, 0.114 of the stored values
    display,  // exposure, x/(1 + max), square root, luminance weights of the file
};
enum class Blend {
    tonemapped,  // a mean in which a bright texel counts less, 1/sqrt(1 + largest channel)
    stored,      // the mean of the stored values
};
// Pixels that are filtered.
enum class Where {
    everywhere,
    blurred,  // those of an earlier blur's hint, in part where the gate is below 1
};
enum class Hint { none, checkerboard, threshold };
enum class HintGate { tile, pixel };  // channel x or y of the hint plane

// Rule of elision: with where: blurred.
inline constexpr const char* kRuleUnhintedBlocks = "unhinted_blocks";

struct Parameters {
    Mode mode = Mode::search;
    int preset = 12;                       // for mode: search
    double subpix = 0.75;                  // for mode: search and the checkerboard
    std::optional<double> edge_threshold;  // unset = Thresholds of the mode
    std::optional<double> edge_threshold_min;
    Luma luma = Luma::display;
    double exposure_ev = 0;
    Blend blend = Blend::tonemapped;
    Where where = Where::everywhere;
    Hint hint = Hint::threshold;
    HintGate hint_gate = HintGate::pixel;
};

// Least contrast that is filtered: the larger of `least` and `relative` times the largest luma.
struct Thresholds {
    double relative;
    double least;
};
// As set; if unset, FXAA 3.11's default (0.166, 0.0833) for mode: search, and for mode: directional
// its lowest, "overkill" and "visible limit" (0.063, 0.0312).
Thresholds thresholds(const Parameters& parameters);

// Presets in rising order, and the steps of one along an edge: increments in pixels, the last one
// made without a fetch. Empty for a number that is not a preset.
std::vector<int64_t> presets();
const std::vector<double>& preset_steps(int preset);

// "fxaa": reads color, and hint (optional) unless Parameters::hint is none and Parameters::where
// everywhere; writes color.
const PassType& pass_type();

}  // namespace postchain::fxaa
