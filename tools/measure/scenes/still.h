// Static scene: every motion vector is exactly zero. Depths from 0.6 to 20 and a sky, to isolate
// lens effects and to test elision of motion blur.
#pragma once

#include "tools/measure/scenes/model.h"

namespace postchain::scenes {

SceneModel make_still();

}  // namespace postchain::scenes
