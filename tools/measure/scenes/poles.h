// Thin things before a fast pan, as figure 11 of the report: poles and wires of the world sweep by,
// others ride on the camera and stay put or swing, over a city with lit windows, ground and sky.
#pragma once

#include "tools/measure/scenes/model.h"

namespace postchain::scenes {

SceneModel make_poles();

}  // namespace postchain::scenes
