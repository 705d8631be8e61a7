// The models of the generated scenes.
#pragma once

#include <string>
#include <vector>

#include "tools/scenes/model.h"

namespace postchain::scenes {

struct SceneInfo {
    std::string name;
    std::string help;  // one line
    SceneModel (*make)() = nullptr;
};
const std::vector<SceneInfo>& scenes();

}  // namespace postchain::scenes
