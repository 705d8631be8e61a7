// Figure 14 of Guertin and Nowrouzezahrai's report (2013) in our own geometry: a red wheel near, a
// green one in focus, a blue one far, each with its own speed and direction, before a brick wall.
#pragma once

#include "tools/measure/scenes/model.h"

namespace postchain::scenes {

SceneModel make_wheels();

}  // namespace postchain::scenes
