// Memory of a device for images and buffers: parts of a few blocks, or of the host.
#pragma once

#include <vulkan/vulkan_core.h>

#include <cstddef>
#include <cstdint>
#include <functional>
#include <list>

#include "chain/base/status.h"

namespace postchain::vk {

struct MemoryPart {
    VkDeviceMemory memory = VK_NULL_HANDLE;
    VkDeviceSize offset = 0, bytes = 0;
    std::byte* mapped = nullptr;  // its first byte, if the host can see it
    void* owner = nullptr;        // its block, or what the host's function set
};

// Images and buffers are not in one block, so that bufferImageGranularity does not matter.
enum class Contents { images, buffers };

// Functions of the host that replace the blocks; both or neither.
struct HostMemory {
    std::function<VkResult(const VkMemoryRequirements&, VkMemoryPropertyFlags, MemoryPart&)>
        allocate;
    std::function<void(const MemoryPart&)> free;
};

// Functions that allocate and free blocks.
struct BlockFunctions {
    // Memory of at least needs.size bytes, mapped if `properties` have HOST_VISIBLE, and the number
    // of its type.
    std::function<Status(const VkMemoryRequirements& needs, VkMemoryPropertyFlags properties,
                         MemoryPart& made, uint32_t& type)>
        make;
    std::function<void(VkDeviceMemory)> destroy;
};

class Memory {
  public:
    Memory(BlockFunctions functions, HostMemory host)
        : functions_(std::move(functions)), host_(std::move(host)) {}
    Memory(const Memory&) = delete;
    Memory& operator=(const Memory&) = delete;

    // The bytes that the next allocations will take together: they get one block, of 256 MiB at
    // most, unless one of them is larger.
    void expect(VkDeviceSize bytes) { expected_ = bytes; }
    // `properties`: VK_MEMORY_PROPERTY_DEVICE_LOCAL_BIT is a wish, all others are needed. Errors:
    // those of BlockFunctions::make() and of the host.
    Result<MemoryPart> allocate(const VkMemoryRequirements& needs, VkMemoryPropertyFlags properties,
                                Contents contents);
    // Frees its block too if no other part of it is in use.
    void free(const MemoryPart& part);

  private:
    struct Span {
        VkDeviceSize offset, bytes;
    };
    struct Block {
        MemoryPart whole;
        uint32_t type;
        VkMemoryPropertyFlags properties;
        Contents contents;
        std::list<Span> unused;  // by offset; no two touch
    };
    static bool take(Block& block, const VkMemoryRequirements& needs, MemoryPart& part);

    const BlockFunctions functions_;
    const HostMemory host_;
    std::list<Block> blocks_;
    VkDeviceSize expected_ = 0;
};

}  // namespace postchain::vk
