// Frames for the Vulkan library, and the same ones for the GL library.
#pragma once

#include <memory>
#include <postchain/postchain.hpp>

#include "tests/guest/host.h"
#include "tests/vulkan/image.h"

namespace postchain::test {

struct DestroyVk {
    void operator()(pc_vk_instance* instance) const { pc_vk_destroy(instance); }
};
using VkInstanceOfChain = std::unique_ptr<pc_vk_instance, DestroyVk>;

pc_vk_create_info vk_info(uint32_t max_width, uint32_t max_height);
// A failure fails the test.
VkInstanceOfChain vk_instance(const pc_vk_create_info& info);
VkInstanceOfChain vk_instance(uint32_t max_width, uint32_t max_height);

// The planes of canonical_frame() as images, R32G32B32A32_SFLOAT, R32_SFLOAT and R32G32_SFLOAT, and
// an output. `vk` refers to `frame`.
struct VkFrame {
    HostImage color, depth, motion, output;
    pc_frame frame;
    pc_vk_frame vk;

    VkFrame(const FramePlanes& planes, const pc_frame& values);
    VkFrame(const VkFrame&) = delete;
};

// A frame whose planes, size (at most this), lens, shutter and number are its own.
std::unique_ptr<VkFrame> random_frame(int max_width, int max_height, uint32_t seed);

void prepare(const VkInstanceOfChain& instance, const pc::Chain& chain, const pc_vk_frame& frame);
// Records, submits and waits.
pc_result run(const VkInstanceOfChain& instance, const pc::Chain& chain, const pc_vk_frame& frame);
pc_counters count(const VkInstanceOfChain& instance);
// Vulkan filters as GL does. Lavapipe and llvmpipe have one compiler and give the same bits; the
// two compilers of a GPU's driver round differently.
void expect_as_gl(const ImageF& found, const ImageF& expected);
// prepare() and run() of a frame; its output. A failure fails the test.
ImageF filtered(const VkInstanceOfChain& instance, const pc::Chain& chain, VkFrame& frame);

}  // namespace postchain::test
