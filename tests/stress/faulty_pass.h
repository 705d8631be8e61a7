// A pass that copies its color with one known fault, and promises that it has none, for the checks
// to find. Its shader is
// faulty.comp beside this file: POSTCHAIN_SHADER_DIR must name this folder while it is compiled.
#pragma once

#include "chain/chain.h"

namespace postchain::stress {

enum class Fault {
    none,
    looks_left,    // a quarter of each pixel comes from the left
    looks_up,      // from above
    blurs_rows,    // to both sides alike, but not up and down
    shades_tiles,  // brighter by the place in a tile of 40 px
    shades_frame,  // by the place in the frame
    brightens,     // 1.1 times the light
    dims,          // 0.9 times
    counts_runs,   // every run is brighter than the one before
};

// It promises everything, whatever its fault: `light` of its light.
Chain chain_with(Fault fault, Light light = Light::kept);

}  // namespace postchain::stress
