// Bad input: a status and a sentence, and nothing is recorded. And that the layers see mistakes.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>
#include <map>

#include "tests/support/transcript.h"
#include "tests/vulkan/frames.h"

namespace postchain::test::input_test {
namespace {

using ::testing::HasSubstr;

const char* const kExpected = POSTCHAIN_SOURCE_DIR "/tests/vulkan/expected";
constexpr int kWidth = 40, kHeight = 24;

// A loader that leads to the device's functions, but to a device that can do less.
struct Weak {
    VkPhysicalDeviceProperties properties = {};
    VkPhysicalDeviceFeatures features = {};
    VkQueueFamilyProperties family = {};
    VkFormat not_stored = VK_FORMAT_UNDEFINED;
    std::string_view without;  // a function

    Weak() {
        const VkPhysicalDevice device = Vulkan::get().physical;
        uint32_t count = 1;
        vkGetPhysicalDeviceProperties(device, &properties);
        vkGetPhysicalDeviceFeatures(device, &features);
        vkGetPhysicalDeviceQueueFamilyProperties(device, &count, &family);
    }
};
Weak weak;

PFN_vkVoidFunction VKAPI_CALL weak_device_loader(VkDevice device, const char* name) {
    return weak.without == name ? nullptr : vkGetDeviceProcAddr(device, name);
}
PFN_vkVoidFunction VKAPI_CALL weak_loader(VkInstance instance, const char* name) {
    const std::string_view asked = name;
    const auto any = [](auto function) { return reinterpret_cast<PFN_vkVoidFunction>(function); };
    if (weak.without == asked) return nullptr;
    if (asked == "vkGetDeviceProcAddr") return any(&weak_device_loader);
    if (asked == "vkGetPhysicalDeviceProperties")
        return any(+[](VkPhysicalDevice, VkPhysicalDeviceProperties* properties) {
            *properties = weak.properties;
        });
    if (asked == "vkGetPhysicalDeviceFeatures")
        return any(+[](VkPhysicalDevice, VkPhysicalDeviceFeatures* features) {
            *features = weak.features;
        });
    if (asked == "vkGetPhysicalDeviceQueueFamilyProperties")
        return any(+[](VkPhysicalDevice, uint32_t* count, VkQueueFamilyProperties* families) {
            *count = 1;
            if (families) *families = weak.family;
        });
    if (asked == "vkGetPhysicalDeviceFormatProperties")
        return any(+[](VkPhysicalDevice device, VkFormat format, VkFormatProperties* properties) {
            vkGetPhysicalDeviceFormatProperties(device, format, properties);
            if (format == weak.not_stored)
                properties->optimalTilingFeatures &=
                    ~VkFormatFeatureFlags(VK_FORMAT_FEATURE_STORAGE_IMAGE_BIT);
        });
    return vkGetInstanceProcAddr(instance, name);
}

// A chain, an instance that is prepared, and a frame.
struct Subject {
    pc::Chain chain;
    VkInstanceOfChain instance = vk_instance(kWidth, kHeight);
    HostFrameTextures canonical = canonical_frame(kWidth, kHeight);
    VkFrame frame{canonical.test.planes, canonical.frame};

    explicit Subject(const char* passes = "fxaa") : chain(test::chain(passes)) {
        prepare(instance, chain, frame.vk);
    }
};

void expect_no_instance(const pc_vk_create_info& info) {
    auto* made = reinterpret_cast<pc_vk_instance*>(1);
    expect_refused(pc_vk_create(&info, &made));
    EXPECT_EQ(made, nullptr);
}

TEST(Input, CreationIsRefusedWithASentence) {
    const Transcript whole(kExpected);
    const pc_vk_create_info good = vk_info(kWidth, kHeight);
    pc_vk_instance* made = nullptr;
    EXPECT_EQ(pc_vk_create(&good, nullptr), PC_ERROR_ARGUMENT);
    expect_refused(pc_vk_create(nullptr, &made));
    void (*const changes[])(pc_vk_create_info&) = {
        [](auto& info) { info.struct_size = 4; },
        [](auto& info) { info.api_version = 0x00020000; },
        [](auto& info) { info.flags = PC_OWN_CONTEXT; },
        [](auto& info) { info.runs_in_flight = 65; },
        [](auto& info) { info.get_instance_proc_addr = nullptr; },
        [](auto& info) {
            info.get_instance_proc_addr = [](VkInstance, const char*) {
                return PFN_vkVoidFunction();
            };
        },
        [](auto& info) { info.instance = nullptr; },
        [](auto& info) { info.physical_device = nullptr; },
        [](auto& info) { info.device = nullptr; },
        [](auto& info) { info.queue_family = 7; },
        [](auto& info) { info.max_width = 0; },
        [](auto& info) { info.max_height = 0; },
        [](auto& info) { info.max_width = 1u << 20; },
        [](auto& info) { info.max_height = 1u << 20; }};
    for (const auto change : changes) {
        pc_vk_create_info info = good;
        change(info);
        expect_no_instance(info);
    }
    // Members of a newer header, if they are 0.
    struct {
        pc_vk_create_info info;
        uint64_t more = 0;
    } newer{good};
    newer.info.struct_size = sizeof(newer);
    vk_instance(newer.info);
    newer.more = 1;
    expect_no_instance(newer.info);
}

TEST(Input, DevicesThatLackWhatTheProgramsNeedAreRefused) {
    const Transcript whole(kExpected);
    pc_vk_create_info info = vk_info(kWidth, kHeight);
    info.get_instance_proc_addr = weak_loader;
    void (*const weaken[])(Weak&) = {
        [](Weak& w) { w.properties.limits.maxComputeWorkGroupInvocations = 255; },
        [](Weak& w) { w.properties.limits.maxComputeSharedMemorySize = 32767; },
        [](Weak& w) { w.properties.limits.maxPerStageDescriptorStorageImages = 7; },
        [](Weak& w) { w.properties.apiVersion = VK_MAKE_API_VERSION(0, 1, 1, 300); },
        [](Weak& w) { w.features.shaderStorageImageWriteWithoutFormat = VK_FALSE; },
        [](Weak& w) { w.without = "vkCmdDispatchIndirect"; },
        [](Weak& w) { w.without = "vkGetPhysicalDeviceFeatures"; },
        [](Weak& w) { w.family.queueFlags &= ~VkQueueFlags(VK_QUEUE_COMPUTE_BIT); }};
    for (const auto one : weaken) {
        weak = Weak();
        one(weak);
        expect_no_instance(info);
    }
    // Just what is needed. Then there are no times, and outputs of all formats but one.
    weak = Weak();
    weak.properties.apiVersion = VK_API_VERSION_1_2;
    weak.properties.limits.maxComputeWorkGroupInvocations = 256;
    weak.properties.limits.maxComputeSharedMemorySize = 32768;
    weak.properties.limits.maxPerStageDescriptorStorageImages = 8;
    weak.family.timestampValidBits = 0;
    weak.not_stored = VK_FORMAT_R8G8B8A8_UNORM;
    Subject subject;
    const auto vulkan = vk_instance(info);
    EXPECT_EQ(pc_vk_set_timing(vulkan.get(), 0), PC_OK);
    expect_refused(pc_vk_set_timing(vulkan.get(), 1));
    prepare(vulkan, subject.chain, subject.frame.vk);
    subject.frame.vk.output.format = weak.not_stored;
    expect_refused(pc_vk_prepare(vulkan.get(), subject.chain.get(), &subject.frame.vk, 1));
    weak = Weak();
}

TEST(Input, HandlesAreChecked) {
    Subject subject;
    pc_vk_instance* const good = subject.instance.get();
    pc_chain* const chain = subject.chain.get();
    const pc_vk_frame* const frame = &subject.frame.vk;
    auto needs = pc::make<pc_frame_needs>();
    auto counters = pc::make<pc_counters>();
    size_t size = 0;
    const auto commands = reinterpret_cast<VkCommandBuffer>(&size);  // not looked at
    const auto refuses = [](std::initializer_list<pc_result> codes) {
        for (const pc_result code : codes) EXPECT_EQ(code, PC_ERROR_ARGUMENT);
        EXPECT_STRNE(pc_error(), "");
    };
    const auto refuses_frames = [&](pc_vk_instance* instance, pc_chain* of,
                                    const pc_vk_frame* one) {
        refuses({pc_vk_prepare(instance, of, one, 1), pc_vk_run(instance, of, one, commands),
                 pc_vk_query_frame(instance, of, one, &needs)});
    };
    const auto gl = instance();
    pc_vk_instance* const destroyed = vk_instance(kWidth, kHeight).release();
    pc_vk_destroy(destroyed);
    for (pc_vk_instance* none :
         {static_cast<pc_vk_instance*>(nullptr), reinterpret_cast<pc_vk_instance*>(chain),
          reinterpret_cast<pc_vk_instance*>(gl.get()), destroyed}) {
        refuses_frames(none, chain, frame);
        refuses({pc_vk_count(none, &counters), pc_vk_explain(none, nullptr, &size)});
        EXPECT_STREQ(pc_vk_last_error(none), "no such instance");
        pc_vk_destroy(none);
    }
    refuses_frames(good, nullptr, frame);
    refuses_frames(good, reinterpret_cast<pc_chain*>(good), frame);
    refuses_frames(good, chain, nullptr);
    refuses({pc_count(reinterpret_cast<pc_instance*>(good), &counters),
             pc_vk_query_frame(good, chain, frame, nullptr), pc_vk_count(good, nullptr),
             pc_vk_explain(good, nullptr, nullptr)});
    expect_error(pc_vk_run(good, chain, frame, nullptr), PC_ERROR_ARGUMENT,
                 "command_buffer is NULL");
    EXPECT_STREQ(pc_vk_last_error(good), pc_error());
}

// A mistake in a frame: the result, the member in the text, the output as it was, and no command
// recorded, so that the run after it is right. Textures of GL have the same checks of sizes and
// values (tests/guest/bad_input_test.cpp).
TEST(Input, FramesAreRefusedWithASentence) {
    const Transcript whole(kExpected);
    Subject subject;
    const pc_vk_frame good = subject.frame.vk;
    const pc_frame good_values = subject.frame.frame;
    const auto refused = [&](const std::function<void(pc_vk_frame&, pc_frame&)>& change) {
        pc_vk_frame frame = good;
        pc_frame values = good_values;
        frame.values = &values;
        change(frame, values);
        const pc_result code =
            pc_vk_prepare(subject.instance.get(), subject.chain.get(), &frame, 1);
        EXPECT_EQ(run(subject.instance, subject.chain, frame), code);
        expect_refused(code);
        EXPECT_STREQ(pc_error(), pc_vk_last_error(subject.instance.get()));
    };
    using F = pc_vk_frame&;
    using V = pc_frame&;
    refused([](F f, V) { f.struct_size = 8; });
    refused([](F f, V) { f.flags = PC_HALF_PLANES; });
    refused([](F f, V) { f.flags = 1u << 31; });
    refused([](F f, V) { f.values = nullptr; });
    // Values of a frame and of its neighbors.
    pc_vk_frame other = good;
    pc_frame other_values = good_values;
    const auto refused_values = [&](const std::function<void(V)>& change) {
        refused([&](F, V v) { change(v); });
        other_values = good_values;
        change(other_values);
        other.values = &other_values;
        for (const auto neighbor : {&pc_vk_frame::before, &pc_vk_frame::after})
            refused([&](F f, V) { f.*neighbor = &other; });
    };
    for (const auto of : {&pc_frame::color, &pc_frame::depth, &pc_frame::motion, &pc_frame::mask,
                          &pc_frame::exposure, &pc_frame::output})
        refused_values([&](V v) { (v.*of).name = 3; });
    for (const auto of : {&pc_frame::color_slice, &pc_frame::depth_slice, &pc_frame::motion_slice,
                          &pc_frame::mask_slice, &pc_frame::output_slice})
        for (const pc_slice slice : {pc_slice{1, 0, 0}, {0, 1, 0}, {0, 0, 1}})
            refused_values([&](V v) { v.*of = slice; });
    for (const auto of : {&pc_frame::before, &pc_frame::after})
        refused_values([&](V v) { v.*of = &good_values; });
    refused_values([](V v) { v.barriers = 8; });
    for (const auto neighbor : {&pc_vk_frame::before, &pc_vk_frame::after}) {
        const auto refused_other = [&](const auto& change) {
            other = good;
            change(other);
            refused([&](F f, V) { f.*neighbor = &other; });
        };
        refused_other([](F f) { f.struct_size = 8; });
        refused_other([](F f) { f.flags = PC_CAMERA_CUT; });
        refused_other([](F f) { f.values = nullptr; });
    }
    refused([&](F f, V) {
        other = good;
        other.motion = {};
        f.after = &other;
    });
    refused([&](F f, V) {
        other = good;
        other.depth.layout = VK_IMAGE_LAYOUT_UNDEFINED;
        f.before = &other;
    });
    refused([](F f, V) { f.color.view = VK_NULL_HANDLE; });
    refused([](F f, V) { f.output.view = VK_NULL_HANDLE; });
    refused([](F f, V) { f.motion.format = VK_FORMAT_R32G32B32_SINT; });
    refused([](F f, V) { f.output.format = VK_FORMAT_R8G8B8A8_SRGB; });
    refused([](F f, V) { f.output.layout = VK_IMAGE_LAYOUT_SHADER_READ_ONLY_OPTIMAL; });
    refused([](F f, V) { f.depth.layout = VK_IMAGE_LAYOUT_UNDEFINED; });
    refused([](F f, V) { f.motion.layout = VK_IMAGE_LAYOUT_DEPTH_STENCIL_READ_ONLY_OPTIMAL; });
    refused([](F f, V) {
        f.output = f.color;
        f.color.layout = VK_IMAGE_LAYOUT_SHADER_READ_ONLY_OPTIMAL;
    });
    refused([](F f, V) { f.output.x = 1; });
    refused([](F f, V) {
        for (pc_vk_image* image : {&f.color, &f.depth, &f.motion, &f.output})
            image->width = kWidth + 1;
    });
    refused([](F f, V) {
        for (pc_vk_image* image : {&f.color, &f.depth, &f.motion, &f.output})
            image->height = kHeight + 1;
    });
    refused([](F, V v) { v.near_clip = std::nanf(""); });

    // Without pc_vk_prepare(), the member.
    pc_frame values = good_values;
    values.debug_view = "host.color";
    pc_vk_frame frame = good;
    frame.values = &values;
    expect_refused(run(subject.instance, subject.chain, frame));

    ImageF untouched = subject.frame.output.read();
    for (const float value : untouched.data) ASSERT_EQ(value, 0);
    EXPECT_EQ(run(subject.instance, subject.chain, good), PC_OK) << pc_error();
    EXPECT_FALSE(equal_bits(subject.frame.output.read(), untouched));
}

TEST(Input, DepthIsReadInEveryLayoutForReads) {
    Subject subject;
    pc_vk_frame frame = subject.frame.vk;
    frame.depth.format = VK_FORMAT_D32_SFLOAT_S8_UINT;
    const auto prepared = [&](VkImageLayout layout) {
        frame.depth.layout = layout;
        return pc_vk_prepare(subject.instance.get(), subject.chain.get(), &frame, 1);
    };
    for (const VkImageLayout layout :
         {VK_IMAGE_LAYOUT_GENERAL, VK_IMAGE_LAYOUT_SHADER_READ_ONLY_OPTIMAL,
          VK_IMAGE_LAYOUT_DEPTH_STENCIL_READ_ONLY_OPTIMAL,
          VK_IMAGE_LAYOUT_DEPTH_READ_ONLY_STENCIL_ATTACHMENT_OPTIMAL,
          VK_IMAGE_LAYOUT_DEPTH_READ_ONLY_OPTIMAL})
        EXPECT_EQ(prepared(layout), PC_OK) << layout << " " << pc_error();
    for (const VkImageLayout layout :
         {VK_IMAGE_LAYOUT_UNDEFINED, VK_IMAGE_LAYOUT_COLOR_ATTACHMENT_OPTIMAL,
          VK_IMAGE_LAYOUT_DEPTH_STENCIL_ATTACHMENT_OPTIMAL,
          VK_IMAGE_LAYOUT_DEPTH_ATTACHMENT_STENCIL_READ_ONLY_OPTIMAL})
        EXPECT_EQ(prepared(layout), PC_ERROR_INPUT) << layout;
}

TEST(Input, ValidationRefusesSingularMatrices) {
    Subject subject;
    auto info = vk_info(kWidth, kHeight);
    info.flags = PC_VALIDATE;
    const auto strict = vk_instance(info);
    subject.frame.frame.view_projection[0] = subject.frame.frame.other_view_projection[0] = 1;
    expect_error(pc_vk_prepare(strict.get(), subject.chain.get(), &subject.frame.vk, 1),
                 PC_ERROR_INPUT, "view_projection: is singular");
}

// Sizes of 1 and the device's limit.
TEST(Input, TheSmallestAndTheLargestSize) {
    VkPhysicalDeviceProperties properties;
    vkGetPhysicalDeviceProperties(Vulkan::get().physical, &properties);
    const uint32_t limit = properties.limits.maxImageDimension2D;
    const auto made = chain("fxaa");
    for (const auto& [width, height] : {std::pair(1, 1), {int(limit), 1}, {1, int(limit)}}) {
        const auto canonical = canonical_frame(16, 16);
        FramePlanes planes;
        for (const Role role : {Role::color, Role::inverse_depth, Role::motion})
            planes[role] = ImageF(width, height, channels_of(role), 0.25f);
        VkFrame frame(planes, canonical.frame);
        const auto vulkan = vk_instance(uint32_t(width), uint32_t(height));
        const ImageF result = filtered(vulkan, made, frame);
        for (size_t i = 0; i < result.data.size(); ++i)
            ASSERT_EQ(result.data[i], 0.25f) << i / 4 << " of " << width << "x" << height;
    }
}

// SPIR-V of a store is used; damaged bytes are not.
TEST(Input, ProgramsAreStored) {
    static std::map<std::string, std::string> all;
    all.clear();
    auto info = vk_info(kWidth, kHeight);
    info.store_program = [](void*, const char* key, const void* bytes, size_t size) {
        all[key] = std::string(static_cast<const char*>(bytes), size);
    };
    info.load_program = [](void*, const char* key, void* bytes, size_t room) {
        const auto found = all.find(key);
        if (found == all.end()) return size_t(0);
        if (room >= found->second.size())
            std::copy(found->second.begin(), found->second.end(), static_cast<char*>(bytes));
        return found->second.size();
    };
    Subject subject;
    const auto loaded = [&](ImageF& result) {
        const auto vulkan = vk_instance(info);
        result = filtered(vulkan, subject.chain, subject.frame);
        EXPECT_EQ(count(vulkan).programs, all.size());
        return count(vulkan).programs_loaded;
    };
    ImageF first, second;
    EXPECT_EQ(loaded(first), 0u);
    EXPECT_GT(all.size(), 1u);
    EXPECT_EQ(loaded(second), all.size());
    EXPECT_TRUE(equal_bits(first, second));
    for (auto& [key, bytes] : all) bytes[bytes.size() / 2] ^= 4;
    EXPECT_EQ(loaded(second), 0u);
    EXPECT_TRUE(equal_bits(first, second));
    for (auto& [key, bytes] : all) bytes.resize(bytes.size() / 2);
    EXPECT_EQ(loaded(second), 0u);
}

// One program a call until none is left.
TEST(Input, PreparationNeedNotWait) {
    Subject subject("motion_blur");
    const auto vulkan = vk_instance(kWidth, kHeight);
    auto needs = pc::make<pc_frame_needs>();
    int pending = 0;
    pc_result code = PC_PENDING;
    for (; code == PC_PENDING; ++pending) {
        EXPECT_EQ(pc_vk_query_frame(vulkan.get(), subject.chain.get(), &subject.frame.vk, &needs),
                  PC_OK);
        EXPECT_EQ(needs.programs_to_compile + uint32_t(pending), needs.programs);
        code = pc_vk_prepare(vulkan.get(), subject.chain.get(), &subject.frame.vk, 0);
    }
    EXPECT_EQ(code, PC_OK) << pc_error();
    EXPECT_EQ(uint32_t(pending), needs.programs);
    EXPECT_EQ(count(vulkan).textures_alive, needs.textures);
    EXPECT_EQ(count(vulkan).texture_bytes, needs.texture_bytes);
    size_t size = 0;
    EXPECT_EQ(run(vulkan, subject.chain, subject.frame.vk), PC_OK);
    EXPECT_EQ(pc_vk_explain(vulkan.get(), nullptr, &size), PC_ERROR_ARGUMENT);
    std::string text(size, '\0');
    EXPECT_EQ(pc_vk_explain(vulkan.get(), text.data(), &size), PC_OK);
    EXPECT_THAT(text, HasSubstr("\"gather\""));
}

// That the layers are at work. Those of synchronization: Steps.WithoutBarriersTheLayersComplain.
TEST(Layers, SeeMistakes) {
    Subject subject("motion_blur");
    auto& messages = Vulkan::get().messages;
    // The host states a layout in which the image is not.
    subject.frame.vk.motion.layout = VK_IMAGE_LAYOUT_SHADER_READ_ONLY_OPTIMAL;
    EXPECT_EQ(run(subject.instance, subject.chain, subject.frame.vk), PC_OK);
    ASSERT_FALSE(messages.empty());
    messages.clear();
    // Two runs in flight are stated, and a third is recorded: the sets of the first change.
    subject.frame.vk.motion.layout = VK_IMAGE_LAYOUT_GENERAL;
    const HostImage others[] = {{VK_FORMAT_R32G32B32A32_SFLOAT, kWidth, kHeight},
                                {VK_FORMAT_R32G32B32A32_SFLOAT, kWidth, kHeight}};
    VkCommandBuffer commands[3];
    for (int i = 0; i < 3; ++i) {
        commands[i] = Vulkan::get().begin();
        full_barrier(commands[i]);
        if (i > 0) subject.frame.vk.output = others[i - 1];
        EXPECT_EQ(
            pc_vk_run(subject.instance.get(), subject.chain.get(), &subject.frame.vk, commands[i]),
            PC_OK);
    }
    VkFence fences[3];
    for (int i = 2; i >= 0; --i) fences[i] = Vulkan::get().submit(commands[i]);
    for (int i = 0; i < 3; ++i) Vulkan::get().wait_for(fences[i], commands[i]);
    EXPECT_FALSE(messages.empty());
    messages.clear();
}

}  // namespace
}  // namespace postchain::test::input_test
