// GLSL to SPIR-V, by glslang. A library without glslang (POSTCHAIN_VULKAN_COMPILER=OFF) takes its
// programs from a ProgramSet.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "chain/base/status.h"

namespace postchain::vk {

// `name`: for messages. StatusCode::gl with the compiler's log, or that there is no compiler.
Result<std::vector<uint32_t>> compile(const std::string& source, const std::string& name);

}  // namespace postchain::vk
