// SPIR-V of a compute shader's source, by glslangValidator and spirv-opt: local variables are gone,
// functions inlined. Ends the program if they fail.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace postchain::test {

std::vector<uint32_t> spirv_of(const std::string& source);

}  // namespace postchain::test
