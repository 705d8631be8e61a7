// Files of config/ that are built into the program: "chains/paper.yaml", "profiles/nuke.yaml".
#pragma once

#include "shaders/embedded.h"

namespace postchain {

const std::vector<EmbeddedFile>& embedded_config();

}  // namespace postchain
