// The bits of Vulkan on lavapipe are those of GL on llvmpipe: one compiler of Mesa behind both.
#include <epoxy/gl.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "config/chain_from_text.h"
#include "tests/vulkan/frames.h"

namespace postchain::test::bits_test {
namespace {

constexpr int kWidth = 96, kHeight = 54;

pc::Chain shipped(const char* name) {
    pc_chain* made = nullptr;
    EXPECT_EQ(pc_chain_shipped(name, &made), PC_OK) << pc_error();
    return pc::Chain(made);
}

pc::Chain from_text(const char* text) {
    pc_chain* made = nullptr;
    EXPECT_EQ(pc_chain_from_text(text, "test", &made), PC_OK) << pc_error();
    return pc::Chain(made);
}

// The frame filtered by GL.
ImageF by_gl(const pc::Chain& chain, const pc_frame& frame, int width, int height) {
    const auto guest = instance();
    return read(prepare_and_run(guest, chain, frame), width, height);
}

void expect_equal(const pc::Chain& chain, const pc_frame& values, const TestFrame& test,
                  const char* name) {
    const int width = test.description.width, height = test.description.height;
    const ImageF expected = by_gl(chain, values, width, height);
    VkFrame frame(test.planes, values);
    const auto vulkan = vk_instance(uint32_t(width), uint32_t(height));
    const ImageF found = filtered(vulkan, chain, frame);
    EXPECT_TRUE(equal_bits(found, expected)) << name << ": " << compare(found, expected, 0).text;
    // The chain did something.
    EXPECT_FALSE(equal_bits(found, test.planes.at(Role::color))) << name;
}

class Shipped : public ::testing::TestWithParam<const char*> {};

TEST_P(Shipped, ChainsHaveTheBitsOfGl) {
    const auto gl = canonical_frame(kWidth, kHeight);
    for (const uint32_t flags : {0u, uint32_t(PC_HALF_PLANES)}) {
        pc_frame values = gl.frame;
        values.flags |= flags;
        expect_equal(shipped(GetParam()), values, gl.test, flags ? "half planes" : "float planes");
    }
}

INSTANTIATE_TEST_SUITE_P(All, Shipped,
                         ::testing::Values("paper", "fast", "balanced", "best", "dof_first"),
                         [](const auto& name) { return std::string(name.param); });

TEST(Bits, MethodsHaveTheBitsOfGl) {
    const auto gl = canonical_frame(kWidth, kHeight);
    const char* const chains[] = {
        "postchain: 1\npasses: [{motion_blur: {mode: guertin, jitter: 0.5}}]",
        "postchain: 1\npasses: [{fxaa: {}}]",
        "postchain: 1\npasses: [{fxaa: {mode: directional}}]",
        "postchain: 1\npasses: [{depth_of_field: {}}]",
        "postchain: 1\npasses: [{depth_of_field: {method: gilham, leak: depth}}]",
        "postchain: 1\npasses: [{joint_blur: {}}, {fxaa: {}}]",
    };
    for (const char* text : chains) expect_equal(from_text(text), gl.frame, gl.test, text);
}

// Depths and colors that change from pixel to pixel, so that searches visit several surfaces: a
// loop of theirs that tests at its end is compiled wrongly by lavapipe.
TEST(Bits, OfNoise) {
    for (const uint32_t seed : {1u, 2u, 3u}) {
        auto gl = canonical_frame(kWidth, kHeight);
        std::mt19937 random(seed);
        auto unit = [&] { return float(random() >> 8) / 16777216.0f; };
        ImageF color = gl.test.planes.at(Role::color),
               depth = gl.test.planes.at(Role::inverse_depth),
               motion = gl.test.planes.at(Role::motion);
        for (float& value : color.data) value = unit();
        for (size_t i = 3; i < color.data.size(); i += 4) color.data[i] = 1;
        for (float& value : depth.data) value = 0.05f + 0.4f * std::floor(4 * unit()) / 4;
        for (float& value : motion.data) value += 8 * unit() - 4;
        const HostTexture c(GL_RGBA32F, color), d(GL_R32F, depth), m(GL_RG32F, motion);
        pc_frame values = gl.frame;
        values.color = c;
        values.depth = d;
        values.motion = m;
        values.f_stop = 0.2f;  // circles of a few pixels
        gl.test.planes[Role::color] = color;
        gl.test.planes[Role::inverse_depth] = depth;
        gl.test.planes[Role::motion] = motion;
        for (const char* text : {"postchain: 1\npasses: [{motion_blur: {}}]",
                                 "postchain: 1\npasses: [{depth_of_field: {}}]",
                                 "postchain: 1\npasses: [{joint_blur: {}}]"})
            expect_equal(from_text(text), values, gl.test, text);
    }
}

}  // namespace
}  // namespace postchain::test::bits_test
