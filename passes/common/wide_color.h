// For double-precision references: color and the further layers in one image, so that what averages
// colors averages the layers with the same weights. Channels 0 to 3 are color's; every decision and
// every weight comes from them. Four more for each layer follow.
#pragma once

#include "chain/pass.h"

namespace postchain {

// `color`, `layers`: roles of this frame or of a neighbor. Without such layers color alone.
ImageD wide_color(const ReferenceFrame& frame, Role color = Role::color,
                  Role layers = Role::layers);

// The color of it alone, and the layers of it as they stand in a plane.
ImageD color_of_wide(const ImageD& wide);
ImageD layers_of_wide(const ImageD& wide);

// Hands it on: planes color and layers, and the stage "layers" where there are some.
void set_wide_color(ReferenceFrame& frame, const ImageD& wide);

}  // namespace postchain
