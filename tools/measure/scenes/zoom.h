// The camera drives down an alley and zooms in at the same time: motion away from a center, larger
// the nearer a thing is. Focal length and focus distance change with every frame. The sky has no
// depth and no vectors, though the zoom moves it: as in any render of this convention.
#pragma once

#include "tools/measure/scenes/model.h"

namespace postchain::scenes {

SceneModel make_zoom();

}  // namespace postchain::scenes
