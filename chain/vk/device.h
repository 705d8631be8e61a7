// A host's Vulkan device: its functions, limits and memory.
#pragma once

#include <vulkan/vulkan_core.h>

#include <cstdint>
#include <memory>
#include <string>
#include <type_traits>

#include "chain/base/status.h"
#include "chain/vk/memory.h"

namespace postchain::vk {

// Functions of the device, resolved by the host's loader: nothing is linked.
#define POSTCHAIN_VK_FUNCTIONS(X)  \
    X(AllocateDescriptorSets)      \
    X(AllocateMemory)              \
    X(BindBufferMemory)            \
    X(BindImageMemory)             \
    X(CmdBindDescriptorSets)       \
    X(CmdBindPipeline)             \
    X(CmdDispatch)                 \
    X(CmdDispatchIndirect)         \
    X(CmdFillBuffer)               \
    X(CmdPipelineBarrier)          \
    X(CmdPushConstants)            \
    X(CmdResetQueryPool)           \
    X(CmdWriteTimestamp)           \
    X(CreateBuffer)                \
    X(CreateComputePipelines)      \
    X(CreateDescriptorPool)        \
    X(CreateDescriptorSetLayout)   \
    X(CreateImage)                 \
    X(CreateImageView)             \
    X(CreatePipelineLayout)        \
    X(CreateQueryPool)             \
    X(CreateSampler)               \
    X(CreateShaderModule)          \
    X(DestroyBuffer)               \
    X(DestroyDescriptorPool)       \
    X(DestroyDescriptorSetLayout)  \
    X(DestroyImage)                \
    X(DestroyImageView)            \
    X(DestroyPipeline)             \
    X(DestroyPipelineLayout)       \
    X(DestroyQueryPool)            \
    X(DestroySampler)              \
    X(DestroyShaderModule)         \
    X(FreeMemory)                  \
    X(GetBufferMemoryRequirements) \
    X(GetImageMemoryRequirements)  \
    X(GetQueryPoolResults)         \
    X(MapMemory)                   \
    X(UpdateDescriptorSets)

struct Functions {
#define POSTCHAIN_VK_MEMBER(name) PFN_vk##name name = nullptr;
    POSTCHAIN_VK_FUNCTIONS(POSTCHAIN_VK_MEMBER)
#undef POSTCHAIN_VK_MEMBER
};

// The host's handles.
struct Handles {
    PFN_vkGetInstanceProcAddr get_instance_proc_addr = nullptr;
    VkInstance instance = VK_NULL_HANDLE;
    VkPhysicalDevice physical = VK_NULL_HANDLE;
    VkDevice device = VK_NULL_HANDLE;
    VkPipelineCache cache = VK_NULL_HANDLE;
    uint32_t queue_family = 0;
    const VkAllocationCallbacks* allocator = nullptr;  // outlives the device; null: the driver's
    HostMemory memory = {};
    bool labels = false;  // objects and commands have names for debuggers
};

// A handle as debuggers take it.
template <class Handle>
uint64_t number_of(Handle handle) {
    if constexpr (std::is_pointer_v<Handle>)
        return reinterpret_cast<uintptr_t>(handle);
    else
        return handle;
}

template <class Info>
Info info_of(VkStructureType type) {
    Info info = {};
    info.sType = type;
    return info;
}

// VK_SUCCESS, or StatusCode::memory or ::gl with the name of the call and of its result.
Status status_of(VkResult result, const char* call);

class Device {
  public:
    Device() = default;
    // StatusCode::usage: a handle is null. StatusCode::gl: the device lacks something.
    Status open(const Handles& handles);

    VkDevice handle() const { return handles_.device; }
    VkPipelineCache cache() const { return handles_.cache; }
    const Functions& fn() const { return fn_; }
    const VkAllocationCallbacks* allocator() const { return handles_.allocator; }
    const VkPhysicalDeviceLimits& limits() const { return limits_; }
    // Bits of a timestamp of the queue family; 0: it has none.
    uint32_t timestamp_bits() const { return timestamp_bits_; }
    // Whether images of this format can be sampled and stored to.
    bool supports(VkFormat format, VkFormatFeatureFlags features) const;
    Memory& memory() const { return *memory_blocks_; }

    // For debuggers; without labels they do nothing.
    bool has_labels() const { return set_name_ != nullptr; }
    void name(VkObjectType type, uint64_t handle, const std::string& name) const;
    void begin_label(VkCommandBuffer commands, const std::string& name) const;
    void end_label(VkCommandBuffer commands) const;

  private:
    Status allocate_block(const VkMemoryRequirements& needs, VkMemoryPropertyFlags properties,
                          MemoryPart& made, uint32_t& type) const;

    Handles handles_;
    Functions fn_;
    VkPhysicalDeviceLimits limits_ = {};
    VkPhysicalDeviceMemoryProperties memory_ = {};
    PFN_vkGetPhysicalDeviceFormatProperties format_properties_ = nullptr;
    uint32_t timestamp_bits_ = 0;
    std::unique_ptr<Memory> memory_blocks_;
    PFN_vkSetDebugUtilsObjectNameEXT set_name_ = nullptr;
    PFN_vkCmdBeginDebugUtilsLabelEXT begin_label_ = nullptr;
    PFN_vkCmdEndDebugUtilsLabelEXT end_label_ = nullptr;
};

// Nearest, clamps to the edge, as GL's (chain/gl/run_objects.h).
class Sampler {
  public:
    Sampler() = default;
    Sampler(const Sampler&) = delete;
    Sampler& operator=(const Sampler&) = delete;
    ~Sampler();
    Status make(const Device& device);  // once
    VkSampler handle() const { return sampler_; }

  private:
    const Device* device_ = nullptr;
    VkSampler sampler_ = VK_NULL_HANDLE;
};

// A buffer with its part of memory, destroyed with this object.
class Buffer {
  public:
    static Result<Buffer> make(const Device& device, VkDeviceSize bytes, VkBufferUsageFlags usage,
                               VkMemoryPropertyFlags properties, const std::string& name);
    Buffer() = default;
    Buffer(Buffer&& other) noexcept;
    Buffer& operator=(Buffer&& other) noexcept;
    ~Buffer();
    VkBuffer handle() const { return buffer_; }
    std::byte* mapped() const { return memory_.mapped; }  // null: the host cannot see it

  private:
    const Device* device_ = nullptr;
    VkBuffer buffer_ = VK_NULL_HANDLE;
    MemoryPart memory_;
};

}  // namespace postchain::vk
