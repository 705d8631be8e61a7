// Objects of the library: memory in few blocks or the host's, layouts that change once, the host's
// allocator, names for debuggers.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <cstring>
#include <map>
#include <set>

#include "chain/vk/device.h"
#include "tests/vulkan/frames.h"

namespace postchain::test::objects_test {
namespace {

using ::testing::Contains;

constexpr int kWidth = 80, kHeight = 48;

// What the library calls, of the functions that a loader of this test replaces.
struct Calls {
    int memory = 0, images = 0, barriers = 0, image_barriers = 0, host_barriers = 0;
    std::set<std::string> labels, names;
};
Calls calls;

VkResult VKAPI_CALL allocate_memory(VkDevice device, const VkMemoryAllocateInfo* info,
                                    const VkAllocationCallbacks* allocator, VkDeviceMemory* made) {
    ++calls.memory;
    return vkAllocateMemory(device, info, allocator, made);
}
VkResult VKAPI_CALL create_image(VkDevice device, const VkImageCreateInfo* info,
                                 const VkAllocationCallbacks* allocator, VkImage* made) {
    ++calls.images;
    return vkCreateImage(device, info, allocator, made);
}
void VKAPI_CALL pipeline_barrier(VkCommandBuffer commands, VkPipelineStageFlags from,
                                 VkPipelineStageFlags to, VkDependencyFlags flags, uint32_t memory,
                                 const VkMemoryBarrier* memories, uint32_t buffers,
                                 const VkBufferMemoryBarrier* of_buffers, uint32_t images,
                                 const VkImageMemoryBarrier* of_images) {
    ++calls.barriers;
    calls.image_barriers += int(images);
    calls.host_barriers += (to & VK_PIPELINE_STAGE_HOST_BIT) != 0 && memory == 1 &&
                           memories->dstAccessMask == VK_ACCESS_HOST_READ_BIT;
    vkCmdPipelineBarrier(commands, from, to, flags, memory, memories, buffers, of_buffers, images,
                         of_images);
}
template <class Function>
Function of_instance(const char* name) {
    return reinterpret_cast<Function>(vkGetInstanceProcAddr(Vulkan::get().instance, name));
}
void VKAPI_CALL begin_label(VkCommandBuffer commands, const VkDebugUtilsLabelEXT* label) {
    calls.labels.insert(label->pLabelName);
    of_instance<PFN_vkCmdBeginDebugUtilsLabelEXT>("vkCmdBeginDebugUtilsLabelEXT")(commands, label);
}
VkResult VKAPI_CALL set_name(VkDevice device, const VkDebugUtilsObjectNameInfoEXT* info) {
    calls.names.insert(info->pObjectName);
    return of_instance<PFN_vkSetDebugUtilsObjectNameEXT>("vkSetDebugUtilsObjectNameEXT")(device,
                                                                                         info);
}

template <class Function>
PFN_vkVoidFunction any(Function function) {
    return reinterpret_cast<PFN_vkVoidFunction>(function);
}
PFN_vkVoidFunction VKAPI_CALL device_function(VkDevice device, const char* name) {
    if (!std::strcmp(name, "vkAllocateMemory")) return any(allocate_memory);
    if (!std::strcmp(name, "vkCreateImage")) return any(create_image);
    if (!std::strcmp(name, "vkCmdPipelineBarrier")) return any(pipeline_barrier);
    return vkGetDeviceProcAddr(device, name);
}
PFN_vkVoidFunction VKAPI_CALL loader(VkInstance instance, const char* name) {
    if (!std::strcmp(name, "vkGetDeviceProcAddr")) return any(device_function);
    if (!std::strcmp(name, "vkCmdBeginDebugUtilsLabelEXT")) return any(begin_label);
    if (!std::strcmp(name, "vkSetDebugUtilsObjectNameEXT")) return any(set_name);
    return vkGetInstanceProcAddr(instance, name);
}
PFN_vkVoidFunction VKAPI_CALL loader_without_labels(VkInstance instance, const char* name) {
    return std::strstr(name, "DebugUtils") ? nullptr : vkGetInstanceProcAddr(instance, name);
}

struct Subject {
    pc::Chain chain = test::chain("fxaa,depth_of_field");
    HostFrameTextures canonical = canonical_frame(kWidth, kHeight);
    VkFrame frame{canonical.test.planes, canonical.frame};
    ImageF expected = filtered(vk_instance(kWidth, kHeight), chain, frame);

    void expect_filters(const VkInstanceOfChain& vulkan) {
        frame.output.write(ImageF(kWidth, kHeight, 4, 0.5f));
        EXPECT_TRUE(equal_bits(filtered(vulkan, chain, frame), expected));
    }
};

pc_vk_create_info counted_info() {
    pc_vk_create_info info = vk_info(kWidth, kHeight);
    info.get_instance_proc_addr = loader;
    calls = {};
    return info;
}

TEST(Objects, ImagesAreInFewBlocks) {
    Subject subject;
    const auto vulkan = vk_instance(counted_info());
    subject.expect_filters(vulkan);
    EXPECT_GT(calls.images, 10);
    // Images, another for the plan of a cut, work lists, uniform blocks.
    EXPECT_LE(calls.memory, 6);
}

TEST(Objects, ImagesChangeTheirLayoutOnce) {
    Subject subject;
    const auto vulkan = vk_instance(counted_info());
    subject.expect_filters(vulkan);
    EXPECT_GT(calls.image_barriers, 5);
    auto counters = pc::make<pc_counters>();
    EXPECT_EQ(pc_vk_count(vulkan.get(), &counters), PC_OK);
    calls = {};
    EXPECT_EQ(run(vulkan, subject.chain, subject.frame.vk), PC_OK);
    EXPECT_EQ(calls.image_barriers, 0);
    // One before each level that waits, one against the runs before, one for emptied lists.
    const uint64_t before = counters.barriers;
    EXPECT_EQ(pc_vk_count(vulkan.get(), &counters), PC_OK);
    EXPECT_EQ(uint64_t(calls.barriers), counters.barriers - before + 1);
}

// Without the barrier a device may keep the depth from the host, even in coherent memory.
TEST(Objects, TheHostSeesTheDepthInFocus) {
    Subject subject;
    const auto vulkan = vk_instance(counted_info());
    EXPECT_EQ(pc_chain_set_point(subject.chain.get(), 1, "focus_at", 0.5, 0.5), PC_OK);
    prepare(vulkan, subject.chain, subject.frame.vk);
    auto before = pc::make<pc_counters>(), after = before;
    for (int i = 0; i < 2; ++i) {
        calls = {};
        EXPECT_EQ(pc_vk_count(vulkan.get(), &before), PC_OK);
        EXPECT_EQ(run(vulkan, subject.chain, subject.frame.vk), PC_OK) << pc_error();
        EXPECT_EQ(pc_vk_count(vulkan.get(), &after), PC_OK);
        EXPECT_EQ(calls.host_barriers, 1);
    }
    EXPECT_EQ(uint64_t(calls.barriers), after.barriers - before.barriers + 1);
}

// The first run, which brings the images to their layout, is never submitted.
TEST(Objects, RunsMayBeGivenUp) {
    Subject subject;
    const auto vulkan = vk_instance(kWidth, kHeight);
    prepare(vulkan, subject.chain, subject.frame.vk);
    const VkCommandBuffer never = Vulkan::get().begin();
    EXPECT_EQ(pc_vk_run(vulkan.get(), subject.chain.get(), &subject.frame.vk, never), PC_OK);
    vkEndCommandBuffer(never);
    EXPECT_EQ(pc_vk_give_up(vulkan.get()), PC_OK);
    subject.expect_filters(vulkan);
}

// Parts of one large allocation of each memory type, with the host's own bookkeeping.
struct HostBlocks {
    struct Block {
        VkDeviceMemory memory = VK_NULL_HANDLE;
        char* mapped = nullptr;
        VkDeviceSize end = 0;
    };
    std::map<uint32_t, Block> blocks;
    int parts = 0, all = 0;
    bool refuses = false;

    static VkResult allocate(void* user, const VkMemoryRequirements* needs,
                             VkMemoryPropertyFlags properties, pc_vk_memory* part) {
        auto& self = *static_cast<HostBlocks*>(user);
        if (self.refuses) return VK_ERROR_OUT_OF_DEVICE_MEMORY;
        Vulkan& host = Vulkan::get();
        const uint32_t type = host.memory_type(needs->memoryTypeBits, properties);
        Block& block = self.blocks[type];
        if (!block.memory) {
            auto info = vk::info_of<VkMemoryAllocateInfo>(VK_STRUCTURE_TYPE_MEMORY_ALLOCATE_INFO);
            info.allocationSize = 64 << 20;
            info.memoryTypeIndex = type;
            EXPECT_EQ(vkAllocateMemory(host.device, &info, nullptr, &block.memory), VK_SUCCESS);
            void* mapped = nullptr;
            VkPhysicalDeviceMemoryProperties types;
            vkGetPhysicalDeviceMemoryProperties(host.physical, &types);
            if (types.memoryTypes[type].propertyFlags & VK_MEMORY_PROPERTY_HOST_VISIBLE_BIT) {
                EXPECT_EQ(vkMapMemory(host.device, block.memory, 0, VK_WHOLE_SIZE, 0, &mapped),
                          VK_SUCCESS);
            }
            block.mapped = static_cast<char*>(mapped);
        }
        const VkDeviceSize at = (block.end + needs->alignment - 1) & ~(needs->alignment - 1);
        block.end = at + needs->size;
        *part = {block.memory, at, block.mapped ? block.mapped + at : nullptr, &self};
        ++self.parts;
        ++self.all;
        return VK_SUCCESS;
    }
    static void free(void* user, const pc_vk_memory* part) {
        EXPECT_EQ(part->allocation, user);
        --static_cast<HostBlocks*>(user)->parts;
    }
    ~HostBlocks() {
        for (const auto& [type, block] : blocks)
            vkFreeMemory(Vulkan::get().device, block.memory, nullptr);
    }
};

TEST(Objects, MemoryMayBeTheHosts) {
    Subject subject;
    HostBlocks blocks;
    pc_vk_create_info info = counted_info();
    info.load_program = nullptr;
    info.store_program = nullptr;
    info.user = &blocks;
    info.allocate_memory = HostBlocks::allocate;
    pc_vk_instance* none = nullptr;
    EXPECT_EQ(pc_vk_create(&info, &none), PC_ERROR_ARGUMENT);
    EXPECT_STREQ(pc_error(), "allocate_memory, free_memory: give both or neither");
    info.free_memory = HostBlocks::free;
    {
        const auto vulkan = vk_instance(info);
        subject.expect_filters(vulkan);
        EXPECT_EQ(calls.memory, 0) << "the library allocated";
        EXPECT_GT(blocks.all, calls.images);
        EXPECT_GT(blocks.parts, 0);
    }
    EXPECT_EQ(blocks.parts, 0) << "not given back";
    blocks.refuses = true;
    EXPECT_EQ(pc_vk_create(&info, &none), PC_ERROR_MEMORY);
    EXPECT_EQ(blocks.parts, 0);
}

TEST(Objects, TheHostsAllocatorIsUsed) {
    static int alive, all;
    alive = all = 0;
    VkAllocationCallbacks allocator = {};
    allocator.pfnAllocation = [](void*, size_t size, size_t alignment, VkSystemAllocationScope) {
        ++alive;
        ++all;
        return std::aligned_alloc(alignment, (size + alignment - 1) / alignment * alignment);
    };
    allocator.pfnReallocation = [](void*, void* old, size_t size, size_t, VkSystemAllocationScope) {
        alive += old ? 0 : 1;
        return std::realloc(old, size);
    };
    allocator.pfnFree = [](void*, void* memory) {
        alive -= memory ? 1 : 0;
        std::free(memory);
    };
    Subject subject;
    pc_vk_create_info info = vk_info(kWidth, kHeight);
    info.allocator = &allocator;
    {
        const auto vulkan = vk_instance(info);
        subject.expect_filters(vulkan);
        EXPECT_GT(alive, 20);
    }
    EXPECT_EQ(alive, 0) << "of " << all;
}

TEST(Objects, HaveNames) {
    Subject subject;
    pc_vk_create_info info = counted_info();
    info.flags = PC_LABELS;
    subject.expect_filters(vk_instance(info));
    EXPECT_THAT(calls.labels, Contains("depth_of_field.gather"));
    EXPECT_THAT(calls.names, Contains(::testing::HasSubstr(".comp")));
    EXPECT_THAT(calls.names, Contains(::testing::StartsWith("postchain ")));
    calls = {};
    subject.expect_filters(vk_instance(counted_info()));
    EXPECT_TRUE(calls.labels.empty() && calls.names.empty());
    // Without the extension: a warning, and no names.
    static std::string logged;
    info.get_instance_proc_addr = loader_without_labels;
    info.log = [](void*, int, const char* text) { logged = text; };
    subject.expect_filters(vk_instance(info));
    EXPECT_EQ(logged, "PC_LABELS has no effect: VK_EXT_debug_utils is not enabled");
}

}  // namespace
}  // namespace postchain::test::objects_test
