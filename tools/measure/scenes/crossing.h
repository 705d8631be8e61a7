// Many solids crossing at 6 to 88 pixels per frame (at 640 px width) in all directions and depths,
// before a wall with a round hole of alpha 0. One pane has alpha 0.5. A solid that leaves the image
// re-enters on the opposite side.
#pragma once

#include "tools/measure/scenes/model.h"

namespace postchain::scenes {

SceneModel make_crossing();

}  // namespace postchain::scenes
