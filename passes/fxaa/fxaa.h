// FXAA: anti-aliasing after the fact, for scene-linear and display-referred pictures.
//
// Source: T. Lottes, FXAA 3.11, quality path. The hint is of B. Guertin,
// M. McGuire, D. Nowrouzezahrai, NVR-2013-003. What it computes, what the hint does and the
// deviations: docs/fxaa.md.
#pragma once

#include <vector>

#include "chain/pass.h"

namespace postchain::fxaa {

// Where the luma that decides comes from.
enum class Luma {
    stored,   // 0.299, 0.587, 0.114 of the stored values
    display,  // exposure, x/(1 + max), square root, luminance weights of the file
};
enum class Blend {
    tonemapped,  // both texels tone-mapped, lerped, inverted
    stored,      // the stored values lerped
};
enum class Hint { none, checkerboard, threshold };
enum class HintGate { tile, pixel };  // channel x or y of the hint plane

struct Parameters {
    int preset = 12;
    double subpix = 0.75;
    double edge_threshold = 0.166;
    double edge_threshold_min = 0.0833;
    Luma luma = Luma::display;
    double exposure_ev = 0;
    Blend blend = Blend::tonemapped;
    Hint hint = Hint::threshold;
    HintGate hint_gate = HintGate::pixel;
};

// Presets in rising order, and the steps of one along an edge: increments in pixels, the last one
// made without a fetch. Empty for a number that is no preset.
std::vector<int64_t> presets();
std::vector<double> preset_steps(int preset);

// "fxaa": reads color, and hint (optional) unless Parameters::hint is none; writes color.
const PassType& pass_type();

}  // namespace postchain::fxaa
