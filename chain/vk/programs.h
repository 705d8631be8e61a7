// Compute pipelines by ProgramKey, each made once.
#pragma once

#include <cstddef>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "chain/base/status.h"
#include "chain/plan/plan.h"
#include "chain/plan/program_source.h"
#include "chain/vk/device.h"
#include "chain/vk/program_set.h"
#include "chain/vk/spirv.h"

namespace postchain::vk {

// The first work group of a band (shaders/common/first_group.glsl). Not that of
// vkCmdDispatchBase(): lavapipe of Mesa 22.3 adds the last one's to the indirect launches after it.
inline constexpr uint32_t kPushedBytes = 2 * sizeof(uint32_t);

struct Program {
    std::vector<Unit> units;
    VkDescriptorSetLayout set = VK_NULL_HANDLE;
    VkPipelineLayout layout = VK_NULL_HANDLE;
    VkPipeline pipeline = VK_NULL_HANDLE;
};

class Programs {
  public:
    // `device` and the sampler of every texture outlive it. `set`, `store`: SPIR-V, looked for in
    // this order.
    Programs(const Device& device, VkSampler sampler, ProgramSet set, ProgramStore store)
        : device_(device), sampler_(sampler), set_(set), store_(std::move(store)) {}
    ~Programs();
    Programs(const Programs&) = delete;
    Programs& operator=(const Programs&) = delete;
    // Stays valid. StatusCode::gl: it does not compile.
    Result<const Program*> get(const ProgramKey& key);
    bool has(const ProgramKey& key) const { return programs_.contains(key.text()); }
    size_t compiled() const { return programs_.size(); }
    size_t loaded() const { return loaded_; }  // from the set or the store

  private:
    Result<Spirv> spirv_of(const ProgramKey& key);
    Status make(const Spirv& spirv, Program& program) const;
    void destroy(const Program& program) const;

    const Device& device_;
    const VkSampler sampler_;
    const ProgramSet set_;
    const ProgramStore store_;
    std::map<std::string, std::unique_ptr<Program>> programs_;
    size_t loaded_ = 0;
};

}  // namespace postchain::vk
