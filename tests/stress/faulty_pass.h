// A pass that copies its color with one known fault while it guarantees everything, so that the
// checks must detect it. Its shader is faulty.comp beside this file: POSTCHAIN_SHADER_DIR must name
// this folder while it is compiled.
#pragma once

#include "chain/pass/chain.h"

namespace postchain::stress {

enum class Fault {
    none,
    looks_left,    // a quarter of each pixel comes from the left
    looks_up,      // from above
    blurs_rows,    // to both sides equally, but not up and down
    shades_tiles,  // brighter by position in a tile of 40 px
    shades_frame,  // brighter by position in the frame
    brightens,     // 1.1 times the light
    dims,          // 0.9 times the light
    counts_runs,   // each run is brighter than the previous one
    takes_depth,   // color times inverse depth
};

// Guarantees everything, whatever its fault; `light` is its guarantee on light.
Chain chain_with(Fault fault, Light light = Light::kept);

}  // namespace postchain::stress
