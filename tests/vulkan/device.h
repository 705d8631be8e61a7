// A host's Vulkan device for tests, under the validation layers with synchronization validation,
// and for benchmarks.
#pragma once

#include <vulkan/vulkan.h>

#include <functional>
#include <string>
#include <vector>

namespace postchain::test {

// Made on first use. Without a device or the layers the process ends with a message.
class Vulkan {
  public:
    static Vulkan& get();
    // Before the first use; false for measurements.
    static inline bool with_layers = true;
    Vulkan(const Vulkan&) = delete;
    Vulkan& operator=(const Vulkan&) = delete;

    VkInstance instance = VK_NULL_HANDLE;
    VkPhysicalDevice physical = VK_NULL_HANDLE;
    bool software = false;
    VkDevice device = VK_NULL_HANDLE;
    VkQueue queue = VK_NULL_HANDLE;
    static constexpr uint32_t kFamily = 0;
    std::vector<std::string> messages;  // of the layers: warnings and errors

    VkCommandBuffer begin();  // a new command buffer, recording
    // Ends and submits it; it is freed by wait_for().
    VkFence submit(VkCommandBuffer commands);
    void wait_for(VkFence fence, VkCommandBuffer commands);
    // Records, submits and waits.
    void run(const std::function<void(VkCommandBuffer)>& record);
    uint32_t memory_type(uint32_t allowed, VkMemoryPropertyFlags properties) const;

  private:
    Vulkan();
    VkCommandPool pool_ = VK_NULL_HANDLE;
};

// All earlier writes become visible to everything.
void full_barrier(VkCommandBuffer commands);

}  // namespace postchain::test
