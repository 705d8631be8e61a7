// Textures read as images give the bits of those that are sampled.
#include <gtest/gtest.h>

#include "chain/gl/device.h"
#include "chain/gl/image_reads.h"
#include "config/chain_find.h"
#include "tests/support/gpu.h"
#include "tests/support/images.h"
#include "tests/support/status.h"

namespace postchain::test {
namespace {

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
    TestFrame frame = layered_frame(150, 90, {21, 9}, {0, 0}, 1);
    add_neighbors(frame);
    add_lights(frame, 2);
    for (const std::string& name : shipped_chains()) {
        const Chain chain = must(load_chain(name, every_pass())).chain;
        for (const Precision precision : {Precision::fp32, Precision::fp16}) {
            const Plan plan = must(make_plan(chain, frame.description, {.precision = precision}));
            const FramePlanes a = must(images.filter(plan, frame.planes));
            const FramePlanes b = must(textures.filter(plan, frame.planes));
            ASSERT_EQ(a.size(), b.size());
            for (const auto& [role, plane] : a)
                EXPECT_TRUE(equal_bits(plane, b.at(role))) << name << ", " << name_of(role);
            EXPECT_FALSE(equal_bits(a.at(Role::color), frame.planes.at(Role::color))) << name;
        }
    }
}

}  // namespace
}  // namespace postchain::test
