// Vulkan filters as GL does.
#include <epoxy/gl.h>
#include <gtest/gtest.h>

#include "config/chain_from_text.h"
#include "tests/support/random.h"
#include "tests/vulkan/frames.h"

namespace postchain::test::bits_test {
namespace {

constexpr int kWidth = 64, kHeight = 38;

// An instance of each library for all chains: programs that chains share are compiled once.
struct Both {
    pc::Instance gl = instance();
    VkInstanceOfChain vulkan = vk_instance(kWidth, kHeight);

    void expect_equal(const char* name, const pc::Chain& chain, const pc_frame& values,
                      const TestFrame& test, const pc_vk_frame* before = nullptr,
                      const pc_vk_frame* after = nullptr) const {
        SCOPED_TRACE(name);
        const ImageF expected = read(prepare_and_run(gl, chain, values), kWidth, kHeight);
        VkFrame frame(test.planes, values);
        frame.vk.before = before;
        frame.vk.after = after;
        const ImageF found = filtered(vulkan, chain, frame);
        expect_as_gl(found, expected);
        EXPECT_FALSE(equal_bits(found, test.planes.at(Role::color))) << "it did nothing";
    }
};

pc::Chain from_text(const char* passes) {
    pc_chain* made = nullptr;
    EXPECT_EQ(
        pc_chain_from_text(concat("postchain: 1\npasses: [{", passes, "}]").c_str(), "test", &made),
        PC_OK)
        << pc_error();
    return pc::Chain(made);
}

using Shipped = std::initializer_list<std::pair<const char*, uint32_t>>;  // names, flags

void expect_shipped(const Both& both, const HostFrameTextures& host, Shipped shipped) {
    for (const auto& [name, flags] : shipped) {
        pc_chain* made = nullptr;
        ASSERT_EQ(pc_chain_shipped(name, &made), PC_OK) << pc_error();
        pc_frame values = host.frame;
        values.flags |= flags;
        both.expect_equal(name, pc::Chain(made), values, host.test);
    }
}

TEST(Bits, ChainsHaveThoseOfGl) {
    expect_shipped(Both(), canonical_frame(kWidth, kHeight),
                   {{"paper", PC_HALF_PLANES}, {"balanced", 0}});
}

TEST(Bits, OtherChainsHaveThoseOfGl) {
    const auto host = canonical_frame(kWidth, kHeight);
    const Both both;
    expect_shipped(
        both, host,
        {{"fast", 0}, {"balanced", PC_HALF_PLANES}, {"best", 0}, {"dof_first", PC_HALF_PLANES}});
    for (const char* passes :
         {"motion_blur: {mode: guertin, jitter: 0.5}", "fxaa: {}", "fxaa: {mode: directional}",
          "depth_of_field: {method: gilham, leak: depth, f_stop: 0.3}"})
        both.expect_equal(passes, from_text(passes), host.frame, host.test);
}

// The frame before in place, the one after converted.
TEST(Bits, NeighborsHaveThoseOfGl) {
    const auto host = canonical_frame(kWidth, kHeight);
    const HostNeighbor before = neighbor_of(host, Neighbor::before);
    HostNeighbor after = neighbor_of(host, Neighbor::after);
    after.frame.flags = PC_BOTTOM_LEFT | PC_MOTION_TO_NEXT;
    after.frame.pre_exposure = 1.5f;
    const VkFrame vk_before(before.planes, before.frame), vk_after(after.planes, after.frame);
    const Both both;
    const auto made = chain("motion_blur");
    pc_frame values = host.frame;
    values.before = &before.frame;
    values.after = &after.frame;
    both.expect_equal("both", made, values, host.test, &vk_before.vk, &vk_after.vk);
    VkFrame alone(host.test.planes, host.frame);
    const ImageF expected = filtered(both.vulkan, made, alone);
    for (const pc_vk_frame* pc_vk_frame::*neighbor : {&pc_vk_frame::before, &pc_vk_frame::after}) {
        VkFrame frame(host.test.planes, host.frame);
        frame.vk.*neighbor = neighbor == &pc_vk_frame::before ? &vk_before.vk : &vk_after.vk;
        EXPECT_FALSE(equal_bits(filtered(both.vulkan, made, frame), expected));
    }
}

// Depths and colors that change from pixel to pixel, so that searches visit several surfaces: a
// loop of theirs that tests at its end is compiled wrongly by lavapipe.
TEST(Bits, OfNoise) {
    const Both both;
    for (const uint32_t seed : {1u, 2u}) {
        auto host = canonical_frame(kWidth, kHeight);
        Random random(seed);
        auto& planes = host.test.planes;
        for (float& value : planes.at(Role::color).data) value = float(random.real());
        for (size_t i = 3; i < planes.at(Role::color).data.size(); i += 4)
            planes.at(Role::color).data[i] = 1;
        for (float& value : planes.at(Role::inverse_depth).data)
            value = 0.05f + 0.1f * float(random.whole(0, 3));
        for (float& value : planes.at(Role::motion).data) value += float(random.real(-4, 4));
        const HostTexture color(GL_RGBA32F, planes.at(Role::color)),
            depth(GL_R32F, planes.at(Role::inverse_depth)),
            motion(GL_RG32F, planes.at(Role::motion));
        pc_frame values = host.frame;
        values.color = color;
        values.depth = depth;
        values.motion = motion;
        values.f_stop = 0.2f;  // circles of a few pixels
        for (const char* pass : {"motion_blur", "depth_of_field", "joint_blur"})
            both.expect_equal(pass, chain(pass), values, host.test);
    }
}

}  // namespace
}  // namespace postchain::test::bits_test
