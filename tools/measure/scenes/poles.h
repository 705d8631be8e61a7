// Thin objects during a fast pan, as in figure 11 of the report: poles and wires sweep by, others
// are attached to the camera, static or swinging, before a city with lit windows, ground and sky.
#pragma once

#include "tools/measure/scenes/model.h"

namespace postchain::scenes {

SceneModel make_poles();

}  // namespace postchain::scenes
