// The comparison of a neighbor's light with this frame's, in the inverse warp's double-precision
// reference (light.comp, shown_surfaces.comp). Written from docs/inverse_warp.md.
#pragma once

#include <vector>

#include "chain/image.h"
#include "passes/inverse_warp/reference_surfaces.h"

namespace postchain::inverse_warp::reference {

// A frame's color and, for each of its pixels, a surface.
struct Lit {
    const ImageD& color;
    const std::vector<Surface>& surfaces;
};

// Makes those of `shown`, the neighbor's surfaces, kNotThere that this frame hides and around which
// the light differs. `there` has the surfaces of the neighbor's planes. offset: -1 before, 1 after
void hide_other_light(const Lit& here, const Lit& there, double offset, const Settings& settings,
                      std::vector<Surface>& shown);

}  // namespace postchain::inverse_warp::reference
