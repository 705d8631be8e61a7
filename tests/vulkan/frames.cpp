#include "tests/vulkan/frames.h"

#include <gtest/gtest.h>

#include <cstring>
#include <map>

#include "tests/support/random.h"

namespace postchain::test {

namespace {

// SPIR-V that the instances of the tests share.
std::map<std::string, std::string>& modules() {
    static std::map<std::string, std::string> all;
    return all;
}

size_t load_module(void*, const char* key, void* bytes, size_t room) {
    const auto found = modules().find(key);
    if (found == modules().end()) return 0;
    if (room >= found->second.size())
        std::memcpy(bytes, found->second.data(), found->second.size());
    return found->second.size();
}

void store_module(void*, const char* key, const void* bytes, size_t size) {
    modules()[key] = std::string(static_cast<const char*>(bytes), size);
}

}  // namespace

pc_vk_create_info vk_info(uint32_t max_width, uint32_t max_height) {
    Vulkan& vk = Vulkan::get();
    pc_vk_create_info info = {};
    info.struct_size = sizeof(info);
    info.api_version = PC_API_VERSION;
    info.get_instance_proc_addr = vkGetInstanceProcAddr;
    info.instance = vk.instance;
    info.physical_device = vk.physical;
    info.device = vk.device;
    info.queue_family = Vulkan::kFamily;
    info.load_program = load_module;
    info.store_program = store_module;
    info.max_width = max_width;
    info.max_height = max_height;
    return info;
}

VkInstanceOfChain vk_instance(const pc_vk_create_info& info) {
    pc_vk_instance* made = nullptr;
    EXPECT_EQ(pc_vk_create(&info, &made), PC_OK) << pc_error();
    return VkInstanceOfChain(made);
}

VkInstanceOfChain vk_instance(uint32_t max_width, uint32_t max_height) {
    return vk_instance(vk_info(max_width, max_height));
}

VkFrame::VkFrame(const FramePlanes& planes, const pc_frame& values)
    : color(VK_FORMAT_R32G32B32A32_SFLOAT, planes.at(Role::color)),
      depth(VK_FORMAT_R32_SFLOAT, planes.at(Role::inverse_depth)),
      motion(VK_FORMAT_R32G32_SFLOAT, planes.at(Role::motion)),
      output(VK_FORMAT_R32G32B32A32_SFLOAT, color.image().width, color.image().height),
      frame(values),
      vk{} {
    frame.color = frame.depth = frame.motion = frame.exposure = frame.output = {};
    frame.before = frame.after = nullptr;
    frame.flags &= ~uint32_t(PC_TOP_LEFT);  // the default of Vulkan
    vk.struct_size = sizeof(vk);
    vk.values = &frame;
    vk.color = color;
    vk.depth = depth;
    vk.motion = motion;
    vk.output = output;
}

std::unique_ptr<VkFrame> random_frame(int max_width, int max_height, uint32_t seed) {
    Random random(seed);
    const int width = random.whole(17, max_width), height = random.whole(17, max_height);
    const auto canonical = canonical_frame(width, height, seed);
    auto frame = std::make_unique<VkFrame>(canonical.test.planes, canonical.frame);
    frame->frame.frame_number = seed;
    frame->frame.focus_distance = float(random.whole(1, 9));
    frame->frame.shutter_frames = 0.1f * float(random.whole(1, 9));
    if (seed % 5 == 4) frame->frame.flags |= PC_CAMERA_CUT;
    return frame;
}

void prepare(const VkInstanceOfChain& instance, const pc::Chain& chain, const pc_vk_frame& frame) {
    EXPECT_EQ(pc_vk_prepare(instance.get(), chain.get(), &frame, 1), PC_OK) << pc_error();
}

pc_result run(const VkInstanceOfChain& instance, const pc::Chain& chain, const pc_vk_frame& frame) {
    pc_result result = PC_OK;
    Vulkan::get().run([&](VkCommandBuffer commands) {
        full_barrier(commands);
        result = pc_vk_run(instance.get(), chain.get(), &frame, commands);
    });
    return result;
}

pc_counters count(const VkInstanceOfChain& instance) {
    auto counters = pc::make<pc_counters>();
    EXPECT_EQ(pc_vk_count(instance.get(), &counters), PC_OK) << pc_error();
    return counters;
}

void expect_as_gl(const ImageF& found, const ImageF& expected) {
    if (Vulkan::get().software)
        expect_equal(found, expected);
    else
        expect_near(found, expected, 1e-5, 0.005);
}

ImageF filtered(const VkInstanceOfChain& instance, const pc::Chain& chain, VkFrame& frame) {
    prepare(instance, chain, frame.vk);
    EXPECT_EQ(run(instance, chain, frame.vk), PC_OK) << pc_error();
    return frame.output.read();
}

}  // namespace postchain::test
