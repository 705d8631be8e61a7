// Nothing moves: every vector is exactly zero. Depths from 0.6 to 20 and a sky, for what only the
// lens does, and for leaving out motion blur.
#pragma once

#include "tools/measure/scenes/model.h"

namespace postchain::scenes {

SceneModel make_still();

}  // namespace postchain::scenes
