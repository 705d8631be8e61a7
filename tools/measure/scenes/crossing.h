// Many solids crossing at 6 to 88 pixels a frame (of a picture 640 wide) in all directions and
// depths, before a wall with a round hole through which there is nothing: alpha 0 there. One pane
// of alpha 0.5 among them. A solid that leaves the picture comes in again on the other side.
#pragma once

#include "tools/measure/scenes/model.h"

namespace postchain::scenes {

SceneModel make_crossing();

}  // namespace postchain::scenes
