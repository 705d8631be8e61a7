// Figure 14 of Guertin and Nowrouzezahrai's report (2013) with new geometry: a near red wheel, a
// green one in focus and a far blue one, each with its own speed and direction, before a brick
// wall.
#pragma once

#include "tools/measure/scenes/model.h"

namespace postchain::scenes {

SceneModel make_wheels();

}  // namespace postchain::scenes
