// Plans for a software renderer and for a GPU compute the same bits; so do textures that are read
// as images, and those that are sampled.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "chain/gl/device.h"
#include "chain/gl/image_reads.h"
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

void expect_equal_bits(const FramePlanes& a, const FramePlanes& b, const TestFrame& frame,
                       const std::string& name) {
    ASSERT_EQ(a.size(), b.size());
    for (const auto& [role, plane] : a)
        EXPECT_TRUE(equal_bits(plane, b.at(role))) << name << ", " << name_of(role);
    EXPECT_FALSE(equal_bits(a.at(Role::color), frame.planes.at(Role::color))) << name;
}

void expect_equal_bits(const Chain& chain, const TestFrame& frame, const std::string& name) {
    const auto plan_for = [&](DeviceClass device) {
        return must(make_plan(chain, frame.description, {.device = device}));
    };
    const Plan software = plan_for(DeviceClass::software), gpu = plan_for(DeviceClass::gpu);
    EXPECT_NE(software, gpu) << name << " has one form";
    expect_equal_bits(must(executor().filter(software, frame.planes)),
                      must(executor().filter(gpu, frame.planes)), frame, name);
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
    TestFrame frame = whole_frame(kWidth, kHeight);
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
    for (const char* pass : {"motion_blur", "joint_blur", "fxaa"})
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

gl::Device with_image_units(int count) {
    executor();  // a GL context
    gl::Device device = gl::describe_current();
    device.software = true;
    device.limits.image_units = count;
    return device;
}

TEST(ImageReads, AreOfSoftwareRenderersWithRoom) {
    gl::Device device = with_image_units(32);
    EXPECT_EQ(device.device_class(), DeviceClass::software);
    device.software = false;
    EXPECT_EQ(device.device_class(), DeviceClass::gpu);
    EXPECT_EQ(with_image_units(8).device_class(), DeviceClass::gpu);  // OpenGL's least
    EXPECT_EQ(gl::best_reads(DeviceClass::software), gl::Reads::images);
    EXPECT_EQ(gl::best_reads(DeviceClass::gpu), gl::Reads::textures);
}

TEST(ImageReads, GiveTheBitsOfTextures) {
    executor();
    if (gl::describe_current().limits.image_units < 32)
        GTEST_SKIP() << "the device has no image units for all textures of a step";
    Executor images(with_image_units(32)), textures(with_image_units(8));
    const TestFrame frame = whole_frame(kWidth, kHeight);
    for (const std::string& name : shipped_chains()) {
        const Chain chain = must(load_chain(name, every_pass())).chain;
        for (const Precision precision : {Precision::fp32, Precision::fp16}) {
            const Plan plan = must(make_plan(chain, frame.description, {.precision = precision}));
            expect_equal_bits(must(images.filter(plan, frame.planes)),
                              must(textures.filter(plan, frame.planes)), frame, name);
        }
    }
}

}  // namespace
}  // namespace postchain::test
