// Mesa's compiler for AMD GPUs (RADV), which compiles for one that this machine does not have.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "chain/base/status.h"
#include "chain/plan/plan.h"

struct VkPipelineExecutableInfoKHR;

namespace postchain::bench {

// Bindings of SPIR-V made by glslangValidator: GL counts textures, images and buffers apart, Vulkan
// counts all together.
inline constexpr uint32_t kUnitsOfAKind = 32;  // textures from 0 on
inline constexpr uint32_t kFirstImage = kUnitsOfAKind;
inline constexpr uint32_t kFirstList = 2 * kUnitsOfAKind;
inline constexpr uint32_t kFirstBlock = 3 * kUnitsOfAKind;

// Removed with its content, by exit() too.
class TemporaryFolder {
  public:
    TemporaryFolder();  // ends the program if it cannot be created
    ~TemporaryFolder();
    TemporaryFolder(const TemporaryFolder&) = delete;
    std::string path(const std::string& name = "") const;

  private:
    std::string path_;
};

// The program as Vulkan's SPIR-V, with these bindings. `shaders`: the folder of the sources; empty:
// the embedded ones. Ends the program if glslangValidator does not compile it.
std::vector<uint32_t> spirv_of(const ProgramKey& program, const std::string& shaders = {});

// Counts for one program, by Mesa's names: "VGPRs", "Instructions".
using Statistics = std::map<std::string, uint64_t>;

class AmdCompiler {
  public:
    // `generation` as RADV_FORCE_FAMILY takes it: "navi21"; RADV ends the process if it does
    // not know the name. Errors (usage): no RADV.
    static Result<std::unique_ptr<AmdCompiler>> create(const std::string& generation);
    ~AmdCompiler();
    AmdCompiler(const AmdCompiler&) = delete;

    struct Compiled {
        Statistics statistics;
        std::string assembly;  // as this Mesa prints it
    };
    // Errors (gl).
    Result<Compiled> compile(const std::vector<uint32_t>& spirv);

  private:
    AmdCompiler();
    struct Handles;
    static std::string assembly_of(const Handles& vk, const VkPipelineExecutableInfoKHR& of);
    std::unique_ptr<Handles> handles_;
};

}  // namespace postchain::bench
