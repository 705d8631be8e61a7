// Files that travel inside the library: GLSL (shaders/), and for the tools the shipped chains and
// renderer profiles (config/).
#pragma once

#include <optional>
#include <string_view>
#include <vector>

namespace postchain {

struct EmbeddedFile {
    std::string_view path;  // relative to its root: "motion_blur/gather.comp"
    std::string_view text;
};

const std::vector<EmbeddedFile>& embedded_shaders();

// Shaders of passes that another library brings (postchain_pass_registry, passes/CMakeLists.txt);
// they may include those above. The files must stay. Returns true.
bool add_shaders(const std::vector<EmbeddedFile>& files);

// The text of a file of embedded_shaders(), or else of one that was added.
std::optional<std::string_view> find_shader(std::string_view path);

}  // namespace postchain
