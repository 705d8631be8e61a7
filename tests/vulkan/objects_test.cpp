// Objects of the library: memory in few blocks or the host's, none for a frame like the last ones,
// layouts that change once, the host's allocator, names for debuggers.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <cstring>
#include <map>
#include <set>
#include <vector>

#include "chain/vk/compiler.h"
#include "chain/vk/device.h"
#include "tests/support/random.h"
#include "tests/vulkan/frames.h"

namespace postchain::test::objects_test {
namespace {

using ::testing::Contains;

constexpr int kWidth = 80, kHeight = 48;

// What the library calls, of the functions that a loader of this test replaces.
struct Calls {
    std::map<std::string, int> made;  // by the function that makes it
    int barriers = 0, image_barriers = 0, host_barriers = 0;
    std::set<std::string> labels, names;
};
Calls calls;

template <class Function>
PFN_vkVoidFunction any(Function function) {
    return reinterpret_cast<PFN_vkVoidFunction>(function);
}

// Those that make something.
#define FUNCTIONS(F)          \
    F(AllocateMemory)         \
    F(CreateBuffer)           \
    F(CreateImage)            \
    F(CreateImageView)        \
    F(CreateComputePipelines) \
    F(CreateDescriptorPool)   \
    F(AllocateDescriptorSets)
#define COUNTED(name)                                                  \
    template <class... Arguments>                                      \
    VkResult VKAPI_PTR counted_##name(Arguments... arguments) {        \
        ++calls.made["vk" #name];                                      \
        return vk##name(arguments...);                                 \
    }                                                                  \
    template <class... Arguments>                                      \
    PFN_vkVoidFunction address_of_##name(VkResult (*)(Arguments...)) { \
        return any(&counted_##name<Arguments...>);                     \
    }
FUNCTIONS(COUNTED)
#undef COUNTED

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

PFN_vkVoidFunction VKAPI_CALL device_function(VkDevice device, const char* name) {
#define LOOK_UP(function) \
    if (!std::strcmp(name, "vk" #function)) return address_of_##function(&vk##function);
    FUNCTIONS(LOOK_UP)
#undef LOOK_UP
#undef FUNCTIONS
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

// Blocks of a device that counts them; type 0, and type 1 for memory that the host sees.
struct Blocks {
    std::map<VkDeviceMemory, VkDeviceSize> alive;
    std::vector<VkDeviceSize> asked;
    VkDeviceSize most = ~VkDeviceSize(0);
    StatusCode refusal = StatusCode::memory;
    uint64_t made = 0;
    vk::Memory memory{{[this](const VkMemoryRequirements& needs, VkMemoryPropertyFlags properties,
                              vk::MemoryPart& part, uint32_t& type) {
                           asked.push_back(needs.size);
                           if (needs.size > most) return Status(refusal, "no room");
                           type = properties & VK_MEMORY_PROPERTY_HOST_VISIBLE_BIT ? 1 : 0;
                           part.memory = reinterpret_cast<VkDeviceMemory>(++made);
                           part.bytes = needs.size;
                           if (type == 1) part.mapped = reinterpret_cast<std::byte*>(made << 40);
                           alive[part.memory] = needs.size;
                           return Status();
                       },
                       [this](VkDeviceMemory block) { EXPECT_EQ(alive.erase(block), 1u); }},
                      {}};

    Result<vk::MemoryPart> allocate(VkDeviceSize size, VkMemoryPropertyFlags properties = 0,
                                    uint32_t types = 3) {
        return memory.allocate({size, 256, types}, properties, vk::Contents::images);
    }
};

// No two parts share a byte, and the last part of a block takes it along, in every order.
TEST(Memory, PartsAreApart) {
    Random random(1);
    Blocks blocks;
    using Kind = std::pair<VkMemoryPropertyFlags, vk::Contents>;
    std::vector<vk::MemoryPart> parts;
    std::map<VkDeviceMemory, Kind> kinds;
    for (int i = 0; i < 2000; ++i) {
        if (!parts.empty() && random.whole(0, i < 1000 ? 3 : 1) == 0) {
            std::swap(parts[size_t(random.whole(0, int(parts.size()) - 1))], parts.back());
            blocks.memory.free(parts.back());
            parts.pop_back();
            continue;
        }
        const auto size = VkDeviceSize(random.whole(1, 40000)), alignment = VkDeviceSize(1)
                                                                            << random.whole(0, 14);
        const bool visible = random.chance(0.5);
        const Kind kind(visible ? VK_MEMORY_PROPERTY_HOST_VISIBLE_BIT : 0,
                        random.chance(0.5) ? vk::Contents::images : vk::Contents::buffers);
        const auto part = blocks.memory.allocate({size, alignment, 3}, kind.first, kind.second);
        ASSERT_TRUE(part.ok());
        EXPECT_EQ(part->offset % alignment, 0u);
        EXPECT_GE(part->bytes, size);
        EXPECT_LE(part->offset + part->bytes, blocks.alive.at(part->memory));
        EXPECT_EQ(part->mapped, visible ? reinterpret_cast<std::byte*>(
                                              (uint64_t(part->memory) << 40) + part->offset)
                                        : nullptr);
        EXPECT_EQ(kinds.try_emplace(part->memory, kind).first->second, kind);
        for (const vk::MemoryPart& other : parts)
            if (other.memory == part->memory) {
                EXPECT_TRUE(part->offset + part->bytes <= other.offset ||
                            other.offset + other.bytes <= part->offset);
            }
        parts.push_back(*part);
    }
    EXPECT_GT(parts.size(), 100u);
    EXPECT_LT(blocks.alive.size(), 60u);
    for (const vk::MemoryPart& part : parts) blocks.memory.free(part);
    EXPECT_TRUE(blocks.alive.empty());
    blocks.memory.free({});
}

// A part that was freed between two others serves again, joined with another one too.
TEST(Memory, GapsAreFilled) {
    constexpr VkDeviceSize kPart = 1 << 18;  // four are a block
    Blocks blocks;
    std::vector<vk::MemoryPart> parts;
    for (int i = 0; i < 4; ++i) parts.push_back(*blocks.allocate(kPart));
    for (const size_t gap : {1u, 2u, 0u, 3u}) {
        blocks.memory.free(parts[gap]);
        EXPECT_EQ(blocks.allocate(kPart)->offset, parts[gap].offset);
    }
    blocks.memory.free(parts[1]);
    blocks.memory.free(parts[2]);
    EXPECT_EQ(blocks.allocate(2 * kPart)->offset, kPart) << "two gaps are one";
    EXPECT_EQ(blocks.asked.size(), 1u);
    EXPECT_TRUE(blocks.allocate(1).ok());
    EXPECT_EQ(blocks.asked.size(), 2u) << "the first is full";
}

TEST(Memory, SizesOfBlocks) {
    constexpr VkDeviceSize kMiB = 1 << 20;
    Blocks blocks;
    const auto asked = [&](VkDeviceSize size, VkMemoryPropertyFlags properties = 0,
                           uint32_t types = 3) {
        blocks.asked.clear();
        EXPECT_TRUE(blocks.allocate(size, properties, types).ok());
        return blocks.asked;
    };
    using Sizes = std::vector<VkDeviceSize>;
    EXPECT_EQ(asked(256), Sizes{kMiB});
    EXPECT_EQ(asked(256, 0, 1), Sizes{}) << "the same block";
    EXPECT_EQ(asked(256, 0, 2), Sizes{kMiB}) << "a type that its block is not of";
    EXPECT_EQ(asked(256, VK_MEMORY_PROPERTY_HOST_VISIBLE_BIT), Sizes{kMiB});
    blocks.memory.expect(3 * kMiB);
    EXPECT_EQ(asked(2 * kMiB), Sizes{3 * kMiB});
    EXPECT_EQ(asked(2 * kMiB), Sizes{2 * kMiB}) << "what was expected is there";
    blocks.memory.expect(600 * kMiB);
    EXPECT_EQ(asked(2 * kMiB), Sizes{256 * kMiB});
    EXPECT_EQ(asked(300 * kMiB), Sizes{300 * kMiB});
    // Less, if a device has no room for more; its other errors are final.
    blocks.most = 5 * kMiB;
    blocks.memory.expect(9 * kMiB);
    EXPECT_EQ(asked(5 * kMiB, VK_MEMORY_PROPERTY_HOST_VISIBLE_BIT), (Sizes{9 * kMiB, 5 * kMiB}));
    const auto refused = [&](VkDeviceSize size, StatusCode code, const Sizes& tries) {
        blocks.asked.clear();
        blocks.refusal = code;
        blocks.memory.expect(9 * kMiB);
        EXPECT_EQ(blocks.allocate(size, VK_MEMORY_PROPERTY_HOST_VISIBLE_BIT).status().code(), code);
        EXPECT_EQ(blocks.asked, tries);
    };
    refused(6 * kMiB, StatusCode::memory, {9 * kMiB, 6 * kMiB});
    refused(10 * kMiB, StatusCode::memory, {10 * kMiB});
    refused(5 * kMiB, StatusCode::gl, {9 * kMiB});
}

TEST(Objects, ImagesAreInFewBlocks) {
    Subject subject;
    const auto vulkan = vk_instance(counted_info());
    subject.expect_filters(vulkan);
    EXPECT_GT(calls.made["vkCreateImage"], 10);
    // Images, another for the plan of a cut, work lists, uniform blocks.
    EXPECT_LE(calls.made["vkAllocateMemory"], 6);
}

// Sizes, lens, focus, shutter, cuts and numbers change; so do the images.
TEST(Objects, FramesOfAnySizeMakeNone) {
    const auto made = chain("motion_blur,fxaa,depth_of_field");
    EXPECT_EQ(pc_chain_set_point(made.get(), 2, "focus_at", 0.5, 0.5), PC_OK);
    const auto vulkan = vk_instance(counted_info());
    std::vector<std::unique_ptr<VkFrame>> frames;
    for (uint32_t i = 0; i < 8; ++i) frames.push_back(random_frame(kWidth, kHeight, i));
    prepare(vulkan, made, frames[0]->vk);
    EXPECT_EQ(calls.made.size(), 7u) << "no call was counted";
    calls = {};
    for (uint32_t i = 0; i < 16; ++i)
        EXPECT_EQ(run(vulkan, made, frames[i % 8]->vk), PC_OK) << pc_error();
    for (const auto& [name, number] : calls.made)
        ADD_FAILURE() << name << " " << number << " times";
}

// A frame at a cut and one that follows another are prepared together.
TEST(Objects, TheFirstFrameOfAShotMakesNone) {
    Subject subject;
    const auto made = chain("motion_blur");
    for (const uint32_t first : {0u, uint32_t(PC_CAMERA_CUT)}) {
        const auto vulkan = vk_instance(counted_info());
        subject.frame.frame.flags = subject.canonical.frame.flags | first;
        prepare(vulkan, made, subject.frame.vk);
        calls = {};
        subject.frame.frame.flags ^= PC_CAMERA_CUT;
        EXPECT_EQ(run(vulkan, made, subject.frame.vk), PC_OK) << pc_error();
        EXPECT_TRUE(calls.made.empty()) << calls.made.begin()->first;
    }
}

TEST(Objects, ImagesChangeTheirLayoutOnce) {
    Subject subject;
    const auto vulkan = vk_instance(counted_info());
    subject.expect_filters(vulkan);
    EXPECT_GT(calls.image_barriers, 5);
    const uint64_t before = count(vulkan).barriers;
    calls = {};
    EXPECT_EQ(run(vulkan, subject.chain, subject.frame.vk), PC_OK);
    EXPECT_EQ(calls.image_barriers, 0);
    // One before each level that waits, one against the runs before, one for emptied lists.
    EXPECT_EQ(uint64_t(calls.barriers), count(vulkan).barriers - before + 1);
}

// Without the barrier a device may keep the depth from the host, even in coherent memory.
TEST(Objects, TheHostSeesTheDepthInFocus) {
    Subject subject;
    const auto vulkan = vk_instance(counted_info());
    EXPECT_EQ(pc_chain_set_point(subject.chain.get(), 1, "focus_at", 0.5, 0.5), PC_OK);
    prepare(vulkan, subject.chain, subject.frame.vk);
    for (int i = 0; i < 2; ++i) {
        const uint64_t before = count(vulkan).barriers;
        calls = {};
        EXPECT_EQ(run(vulkan, subject.chain, subject.frame.vk), PC_OK) << pc_error();
        EXPECT_EQ(calls.host_barriers, 1);
        // The first run also brings images to their layout.
        if (i == 1) {
            EXPECT_EQ(uint64_t(calls.barriers), count(vulkan).barriers - before + 1);
        }
    }
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

// Allocations of the host. Each begins before the part that the library gets.
struct HostMemory {
    int parts = 0, all = 0;
    bool refuses = false;

    static VkResult allocate(void* user, const VkMemoryRequirements* needs,
                             VkMemoryPropertyFlags properties, pc_vk_memory* part) {
        auto& self = *static_cast<HostMemory*>(user);
        if (self.refuses) return VK_ERROR_OUT_OF_DEVICE_MEMORY;
        Vulkan& host = Vulkan::get();
        auto info = vk::info_of<VkMemoryAllocateInfo>(VK_STRUCTURE_TYPE_MEMORY_ALLOCATE_INFO);
        info.allocationSize = needs->alignment + needs->size;
        info.memoryTypeIndex = host.memory_type(needs->memoryTypeBits, properties);
        VkDeviceMemory memory = VK_NULL_HANDLE;
        EXPECT_EQ(vkAllocateMemory(host.device, &info, nullptr, &memory), VK_SUCCESS);
        void* mapped = nullptr;
        if (properties & VK_MEMORY_PROPERTY_HOST_VISIBLE_BIT) {
            EXPECT_EQ(vkMapMemory(host.device, memory, needs->alignment, needs->size, 0, &mapped),
                      VK_SUCCESS);
        }
        *part = {memory, needs->alignment, mapped, &self};
        ++self.parts;
        ++self.all;
        return VK_SUCCESS;
    }
    static void free(void* user, const pc_vk_memory* part) {
        EXPECT_EQ(part->allocation, user);
        vkFreeMemory(Vulkan::get().device, part->memory, nullptr);
        --static_cast<HostMemory*>(user)->parts;
    }
};

TEST(Objects, MemoryMayBeTheHosts) {
    Subject subject;
    HostMemory memory;
    pc_vk_create_info info = counted_info();
    info.load_program = nullptr;
    info.store_program = nullptr;
    info.user = &memory;
    info.allocate_memory = HostMemory::allocate;
    pc_vk_instance* none = nullptr;
    EXPECT_EQ(pc_vk_create(&info, &none), PC_ERROR_ARGUMENT);
    EXPECT_STREQ(pc_error(), "allocate_memory, free_memory: give both or neither");
    info.free_memory = HostMemory::free;
    {
        const auto vulkan = vk_instance(info);
        subject.expect_filters(vulkan);
        EXPECT_EQ(calls.made["vkAllocateMemory"], 0) << "the library allocated";
        EXPECT_GT(memory.all, calls.made["vkCreateImage"]);
        EXPECT_GT(memory.parts, 0);
    }
    EXPECT_EQ(memory.parts, 0) << "not given back";
    memory.refuses = true;
    EXPECT_EQ(pc_vk_create(&info, &none), PC_ERROR_MEMORY);
    EXPECT_EQ(memory.parts, 0);
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

// Preprocessing, parsing and linking each say the place.
TEST(Compiler, SaysWhatIsWrong) {
    using ::testing::HasSubstr;
    const std::string head = "#version 450\nlayout(local_size_x = 8) in;\n";
    EXPECT_TRUE(vk::compile(head + "void main() {}\n", "good.comp").ok());
    for (const auto& [body, said] : {std::pair("#error none\nvoid main() {}\n", "none"),
                                     {"void main() { absent = 1; }\n", "absent"},
                                     {"void main() { }\nvoid other() { main2(); }\n", "main2"}}) {
        const auto program = vk::compile(head + body, "bad.comp");
        EXPECT_EQ(program.status().code(), StatusCode::gl) << body;
        EXPECT_THAT(program.status().message(), HasSubstr("shader bad.comp does not compile:"));
        EXPECT_THAT(program.status().message(), HasSubstr(said));
    }
}

}  // namespace
}  // namespace postchain::test::objects_test
