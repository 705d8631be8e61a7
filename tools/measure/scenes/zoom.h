// The camera drives down an alley while zooming in: radial motion, larger for closer objects. Focal
// length and focus distance change every frame. The sky has no depth and no motion vectors although
// the zoom moves it, as in any render of this convention.

#pragma once

#include "tools/measure/scenes/model.h"

namespace postchain::scenes {

SceneModel make_zoom();

}  // namespace postchain::scenes
