// Plans for a software renderer and for a GPU compute the same bits.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "chain/pass/planner.h"
#include "config/chain_find.h"
#include "shaders/shared/color_limits.h"
#include "tests/support/gpu.h"
#include "tests/support/images.h"
#include "tests/support/status.h"

namespace postchain::test {
namespace {

// All that these chains can use, so that every step with two forms runs.
TestFrame whole_frame(int width, int height) {
    TestFrame frame = layered_frame(width, height, {21, 9}, {3, -2}, 1);
    add_neighbors(frame);
    add_behind(frame);
    add_lights(frame, 2);
    return frame;
}

void expect_equal_bits(const Chain& chain, const TestFrame& frame, const std::string& name) {
    const auto plan_for = [&](DeviceClass device) {
        return must(make_plan(chain, frame.description, {.device = device}));
    };
    const Plan software = plan_for(DeviceClass::software), gpu = plan_for(DeviceClass::gpu);
    EXPECT_NE(software, gpu) << name << " has one form";
    const FramePlanes a = must(executor().filter(software, frame.planes));
    const FramePlanes b = must(executor().filter(gpu, frame.planes));
    ASSERT_EQ(a.size(), b.size());
    for (const auto& [role, plane] : a)
        EXPECT_TRUE(equal_bits(plane, b.at(role))) << name << ", " << name_of(role);
    EXPECT_FALSE(equal_bits(a.at(Role::color), frame.planes.at(Role::color))) << name;
}

// Neither a multiple of a block nor of the squares of several blocks.
constexpr int kWidth = 150, kHeight = 90;

TEST(Forms, OfShippedChainsComputeTheSameBits) {
    const TestFrame frame = whole_frame(kWidth, kHeight);
    for (const std::string& name : shipped_chains())
        expect_equal_bits(must(load_chain(name, every_pass())).chain, frame, name);
}

TEST(Forms, WithTheMostStartSurfacesComputeTheSameBits) {
    for (const char* pass : {"motion_blur", "depth_of_field", "joint_blur"})
        expect_equal_bits(chain_of(pass, {{"starts", int64_t(8)}}), whole_frame(kWidth, kHeight),
                          pass);
}

// All paths of a block are equally long, in other directions: which is chosen is a matter of order.
TEST(Forms, AmongEquallyLongPathsChooseTheSame) {
    TestFrame frame = layered_frame(kWidth, kHeight, {0, 0}, {0, 0}, 3);
    frame.planes[Role::motion] = make_image(kWidth, kHeight, 2, [](int x, int y, int c) {
        const double angle = 0.11 * x + 0.07 * y;
        return 30 * (c == 0 ? std::cos(angle) : std::sin(angle));
    });
    frame.description.bounds = describe(frame.planes).bounds;
    for (const char* pass : {"motion_blur", "joint_blur"})
        expect_equal_bits(chain_of(pass), frame, pass);
}

// A GPU checks the components of a color together.
TEST(Forms, OfColorsBeyondTheLimitsComputeTheSameBits) {
    const float most = shared::kMaxColor, infinite = std::numeric_limits<float>::infinity();
    const float odd[] = {std::nanf(""), -infinite,    infinite, most,
                         -most,         1.01f * most, -1e37f,   std::numeric_limits<float>::max()};
    TestFrame frame = whole_frame(kWidth, kHeight);
    ImageF& color = frame.planes.at(Role::color);
    for (int i = 0; i < 40; ++i) color.at(7 + 37 * i % 131, 5 + 2 * i, i % 4) = odd[i % 8];
    for (const char* pass : {"motion_blur", "depth_of_field", "joint_blur", "fxaa"})
        expect_equal_bits(chain_of(pass), frame, pass);
}

TEST(Forms, OfFxaaComputeTheSameBits) {
    for (const char* mode : {"search", "directional"})
        for (const char* hint : {"none", "checkerboard", "threshold"}) {
            Chain chain = chain_of("motion_blur");
            append(chain, "fxaa", {{"mode", std::string(mode)}, {"hint", std::string(hint)}});
            expect_equal_bits(chain, whole_frame(101, 67), concat(mode, ", ", hint));
        }
}

}  // namespace
}  // namespace postchain::test
