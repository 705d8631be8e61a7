// Files that travel inside the library: GLSL (shaders/), and for the tools the shipped chains and
// renderer profiles (config/).
#pragma once

#include <string_view>
#include <vector>

namespace postchain {

struct EmbeddedFile {
    std::string_view path;  // relative to its root: "motion_blur/gather.comp"
    std::string_view text;
};

const std::vector<EmbeddedFile>& embedded_shaders();

}  // namespace postchain
