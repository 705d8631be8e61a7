// A host's Vulkan device: its functions, limits and memory.
#pragma once

#include <vulkan/vulkan_core.h>

#include <cstdint>

#include "chain/base/status.h"

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
    X(CreateBuffer)                \
    X(CreateComputePipelines)      \
    X(CreateDescriptorPool)        \
    X(CreateDescriptorSetLayout)   \
    X(CreateImage)                 \
    X(CreateImageView)             \
    X(CreatePipelineLayout)        \
    X(CreateSampler)               \
    X(CreateShaderModule)          \
    X(DestroyBuffer)               \
    X(DestroyDescriptorPool)       \
    X(DestroyDescriptorSetLayout)  \
    X(DestroyImage)                \
    X(DestroyImageView)            \
    X(DestroyPipeline)             \
    X(DestroyPipelineLayout)       \
    X(DestroySampler)              \
    X(DestroyShaderModule)         \
    X(FreeMemory)                  \
    X(GetBufferMemoryRequirements) \
    X(GetImageMemoryRequirements)  \
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
};

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
    const VkPhysicalDeviceLimits& limits() const { return limits_; }
    // Whether images of this format can be sampled and stored to.
    bool supports(VkFormat format, VkFormatFeatureFlags features) const;
    // Memory for an object with these requirements. StatusCode::memory.
    Result<VkDeviceMemory> allocate(const VkMemoryRequirements& needs,
                                    VkMemoryPropertyFlags properties) const;

  private:
    Handles handles_;
    Functions fn_;
    VkPhysicalDeviceLimits limits_ = {};
    VkPhysicalDeviceMemoryProperties memory_ = {};
    PFN_vkGetPhysicalDeviceFormatProperties format_properties_ = nullptr;
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

// A buffer with memory of its own, destroyed with this object.
class Buffer {
  public:
    static Result<Buffer> make(const Device& device, VkDeviceSize bytes, VkBufferUsageFlags usage,
                               VkMemoryPropertyFlags properties);
    Buffer() = default;
    Buffer(Buffer&& other) noexcept;
    Buffer& operator=(Buffer&& other) noexcept;
    ~Buffer();
    VkBuffer handle() const { return buffer_; }
    // Maps memory that the host can see.
    Result<std::byte*> map();

  private:
    const Device* device_ = nullptr;
    VkBuffer buffer_ = VK_NULL_HANDLE;
    VkDeviceMemory memory_ = VK_NULL_HANDLE;
};

}  // namespace postchain::vk
