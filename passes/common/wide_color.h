// For double-precision references: color and the extra layers in one image, so that code that
// averages colors averages the layers with the same weights. Channels 0 to 3 are color's; every
// decision and every weight comes from them. Each layer has the next four.
#pragma once

#include "chain/pass/pass.h"

namespace postchain {

// `color`, `layers`: roles of this frame or of a neighbor. Without such layers only color.
ImageD wide_color(const ReferenceFrame& frame, Role color = Role::color,
                  Role layers = Role::layers);

// Only its color, and its layers as they are stacked in a plane.
ImageD color_of_wide(const ImageD& wide);
ImageD layers_of_wide(const ImageD& wide);

// Hands it on: planes color and layers, and the stage "layers" if it has layers.
void set_wide_color(ReferenceFrame& frame, const ImageD& wide);

}  // namespace postchain
