// The bits of Vulkan on lavapipe are those of GL on llvmpipe: one compiler of Mesa behind both.
#include <epoxy/gl.h>
#include <gtest/gtest.h>

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

}  // namespace
}  // namespace postchain::test::bits_test
