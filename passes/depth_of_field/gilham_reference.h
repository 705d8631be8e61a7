// Double-precision reference of `gilham`, written from docs/depth_of_field.md; it shares only the
// sizes of gilham_sizes() with the shaders. Plain sums divided by plain weights: slow, and as close
// to the formulas as code gets.
//
// Storage is not modeled: every stage is
// a double.
#pragma once

#include "passes/depth_of_field/gilham.h"

namespace postchain::depth_of_field {

// Reads color, inverse_depth (and hint) of `frame`; replaces color (and hint); fills the stages
// coc, small, small_depth or small_radius, blur_x, blur_y, color and hint.
void gilham_reference(const Parameters& parameters, const GilhamSizes& sizes,
                      const PlanContext& context, ReferenceFrame& frame);

}  // namespace postchain::depth_of_field
