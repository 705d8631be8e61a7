// Mesa's compiler for AMD GPUs (RADV), which compiles for one that this machine does not have.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "chain/base/status.h"

namespace postchain::bench {

// Bindings of SPIR-V made by glslangValidator: GL counts textures, images and buffers apart, Vulkan
// counts all together.
inline constexpr uint32_t kUnitsOfAKind = 32;  // textures from 0 on
inline constexpr uint32_t kFirstImage = kUnitsOfAKind;
inline constexpr uint32_t kFirstList = 2 * kUnitsOfAKind;
inline constexpr uint32_t kFirstBlock = 3 * kUnitsOfAKind;

// Counts for one program, by Mesa's names: "VGPRs", "Instructions".
using Statistics = std::map<std::string, uint64_t>;

class AmdCompiler {
  public:
    // `generation` as RADV_FORCE_FAMILY takes it: "navi21"; RADV ends the process if it does
    // not know the name. Errors (usage): no RADV.
    static Result<std::unique_ptr<AmdCompiler>> create(const std::string& generation);
    ~AmdCompiler();
    AmdCompiler(const AmdCompiler&) = delete;

    // Errors (gl).
    Result<Statistics> compile(const std::vector<uint32_t>& spirv);

  private:
    AmdCompiler();
    struct Handles;
    std::unique_ptr<Handles> handles_;
};

}  // namespace postchain::bench
