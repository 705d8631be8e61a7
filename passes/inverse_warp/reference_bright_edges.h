// Whose light a pixel at an edge shows, for the inverse warp's double-precision reference. Written
// from docs/inverse_warp.md.
#pragma once

#include <vector>

#include "chain/image.h"
#include "passes/inverse_warp/reference_surfaces.h"

namespace postchain::inverse_warp::reference {

// `surfaces`, of each pixel of RGBA `color` row by row, where bright pixels at edges have got the
// surface whose light they show.
std::vector<Surface> with_bright_edges(const ImageD& color, const std::vector<Surface>& surfaces,
                                       const Settings& settings);

}  // namespace postchain::inverse_warp::reference
