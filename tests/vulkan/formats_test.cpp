// Formats, layouts, rows and rectangles of a host's images: the bits are those of GL textures.
#include <epoxy/gl.h>
#include <gtest/gtest.h>

#include <cmath>

#include "chain/gl/half.h"
#include "tests/vulkan/frames.h"

namespace postchain::test::formats_test {
namespace {

constexpr int kWidth = 70, kHeight = 41;

struct Formats {
    unsigned gl;
    VkFormat vk;
};
constexpr Formats kFloats = {GL_RGBA32F, VK_FORMAT_R32G32B32A32_SFLOAT};
constexpr Formats kHalves = {GL_RGBA16F, VK_FORMAT_R16G16B16A16_SFLOAT};
constexpr Formats kBytes = {GL_RGBA8, VK_FORMAT_R8G8B8A8_UNORM};

struct Case {
    const char* name;
    const char* passes;
    Formats color = kFloats;
    Formats depth = {GL_R32F, VK_FORMAT_R32_SFLOAT};
    Formats motion = {GL_RG32F, VK_FORMAT_R32G32_SFLOAT};
    Formats output = kFloats;
    VkImageLayout color_layout = VK_IMAGE_LAYOUT_GENERAL;
    VkImageLayout depth_layout = VK_IMAGE_LAYOUT_GENERAL;
    bool bottom_up = false;
    pc_depth encoding = PC_DEPTH_INVERSE;
    float pre_exposure = 0;
    const char* view = nullptr;  // a debug view
    bool mask = false;
    bool half_depth = false;  // of half the frame's width and height
    bool halved = false;      // the passes run at half resolution
};

// Drivers convert floats that a host gives or reads, each in its own way. What is filtered is exact
// in halves, and bytes are compared.
void make_exact(ImageF& image) {
    std::vector<uint16_t> halves(image.data.size());
    gl::to_halves(image.data.data(), halves.data(), halves.size());
    gl::from_halves(halves.data(), image.data.data(), halves.size());
}
ImageF bytes_of(ImageF image) {
    for (float& value : image.data) value = std::round(255 * value);
    return image;
}

void expect_equal(const Case& one, const pc::Instance& guest, const VkInstanceOfChain& vulkan) {
    SCOPED_TRACE(one.name);
    auto canonical = canonical_frame(kWidth, kHeight);
    for (auto& [role, plane] : canonical.test.planes) make_exact(plane);
    const FramePlanes& planes = canonical.test.planes;
    const float near_clip = 0.25f;
    ImageF depth = planes.at(Role::inverse_depth);
    if (one.encoding != PC_DEPTH_INVERSE)
        for (float& value : depth.data) value *= near_clip;  // the nearest is 1
    const ImageF mask = textured_image(kWidth, kHeight, 1, 5);
    const pc::Chain made = chain(one.passes);
    pc_frame values = canonical.frame;
    if (one.halved) values.flags |= PC_HALF_RESOLUTION;
    if (one.bottom_up) values.flags ^= PC_TOP_LEFT | PC_BOTTOM_LEFT;
    values.depth_encoding = one.encoding;
    values.near_clip = near_clip;
    values.pre_exposure = one.pre_exposure;
    values.debug_view = one.view;
    if (one.half_depth) values.depth_size[0] = kWidth / 2, values.depth_size[1] = kHeight / 2;

    const HostTexture gl_color(one.color.gl, planes.at(Role::color)), gl_depth(one.depth.gl, depth),
        gl_motion(one.motion.gl, planes.at(Role::motion)), gl_mask(GL_R32F, mask),
        gl_output(one.output.gl, ImageF(kWidth, kHeight, 4, 0.5f));
    pc_frame gl_frame = values;
    gl_frame.color = gl_color;
    gl_frame.depth = gl_depth;
    gl_frame.motion = gl_motion;
    if (one.mask) gl_frame.mask = gl_mask;
    gl_frame.output = gl_output;
    const ImageF expected = read(prepare_and_run(guest, made, gl_frame), kWidth, kHeight);

    VkFrame frame(planes, values);
    const HostImage color(one.color.vk, planes.at(Role::color), one.color_layout),
        vk_depth(one.depth.vk, depth, one.depth_layout),
        motion(one.motion.vk, planes.at(Role::motion)), vk_mask(VK_FORMAT_R32_SFLOAT, mask),
        output(one.output.vk, kWidth, kHeight);
    frame.vk.color = color;
    frame.vk.depth = vk_depth;
    frame.vk.motion = motion;
    if (one.mask) frame.vk.mask = vk_mask;
    frame.vk.output = output;
    filtered(vulkan, made, frame);
    const ImageF found = output.read();
    if (one.output.gl == GL_RGBA8)
        expect_as_gl(bytes_of(found), bytes_of(expected));
    else
        expect_as_gl(found, expected);
}

TEST(Formats, HaveTheBitsOfGl) {
    const Case cases[] = {
        {.name = "halves", .passes = "motion_blur", .color = kHalves, .output = kHalves},
        {.name = "bytes out", .passes = "motion_blur,fxaa", .output = kBytes},
        {.name = "sRGB in",
         .passes = "motion_blur",
         .color = {GL_SRGB8_ALPHA8, VK_FORMAT_R8G8B8A8_SRGB},
         .color_layout = VK_IMAGE_LAYOUT_SHADER_READ_ONLY_OPTIMAL},
        {.name = "depth of the device",
         .passes = "depth_of_field",
         .depth = {GL_DEPTH_COMPONENT32F, VK_FORMAT_D32_SFLOAT},
         .depth_layout = VK_IMAGE_LAYOUT_DEPTH_STENCIL_READ_ONLY_OPTIMAL,
         .encoding = PC_DEPTH_REVERSE_INFINITE},
        {.name = "depth of 16 bits",
         .passes = "depth_of_field",
         .depth = {GL_DEPTH_COMPONENT16, VK_FORMAT_D16_UNORM},
         .encoding = PC_DEPTH_REVERSE_INFINITE},
        {.name = "rows from the bottom",
         .passes = "motion_blur,depth_of_field",
         .motion = {GL_RG16F, VK_FORMAT_R16G16_SFLOAT},
         .bottom_up = true},
        {.name = "gain", .passes = "fxaa", .output = kHalves, .pre_exposure = 3},
        {.name = "nothing to do", .passes = "fxaa", .output = kBytes, .view = "host.color"},
        {.name = "view of a work list",
         .passes = "motion_blur",
         .view = "0.motion_blur.moving_blocks"},
        {.name = "view of the fill mask", .passes = "motion_blur", .view = "fill"},
        {.name = "mask", .passes = "motion_blur,depth_of_field", .mask = true},
        {.name = "depth of half size", .passes = "depth_of_field", .half_depth = true},
        {.name = "half resolution", .passes = "motion_blur,depth_of_field", .halved = true},
        {.name = "color alone at half resolution", .passes = "fxaa", .halved = true},
    };
    const auto guest = instance();
    const auto vulkan = vk_instance(kWidth, kHeight);
    for (const Case& one : cases) expect_equal(one, guest, vulkan);
}

// A swapchain's order of channels, which GL does not store to.
TEST(Formats, BlueFirstHasTheSameBytes) {
    const auto canonical = canonical_frame(kWidth, kHeight);
    const auto made = chain("motion_blur");
    const auto vulkan = vk_instance(kWidth, kHeight);
    VkFrame frame(canonical.test.planes, canonical.frame);
    const HostImage bytes(VK_FORMAT_R8G8B8A8_UNORM, kWidth, kHeight),
        blue_first(VK_FORMAT_B8G8R8A8_UNORM, kWidth, kHeight);
    frame.vk.output = bytes;
    filtered(vulkan, made, frame);
    frame.vk.output = blue_first;
    filtered(vulkan, made, frame);
    ImageF expected = bytes.read();
    for (size_t i = 0; i < expected.data.size(); i += 4)
        std::swap(expected.data[i], expected.data[i + 2]);
    EXPECT_TRUE(equal_bits(blue_first.read(), expected));
}

TEST(Formats, OutputMayBeColor) {
    const auto canonical = canonical_frame(kWidth, kHeight);
    const auto vulkan = vk_instance(kWidth, kHeight);
    for (const char* passes : {"motion_blur,fxaa", "fxaa"}) {
        const auto made = chain(passes);
        VkFrame frame(canonical.test.planes, canonical.frame);
        const ImageF expected = filtered(vulkan, made, frame);
        frame.vk.output = frame.color;
        filtered(vulkan, made, frame);
        EXPECT_TRUE(equal_bits(frame.color.read(), expected)) << passes;
    }
}

// Only the rectangle is read and written.
TEST(Formats, RectanglesOfLargerImages) {
    const auto canonical = canonical_frame(kWidth, kHeight);
    const FramePlanes& planes = canonical.test.planes;
    const auto made = chain("motion_blur,fxaa");
    const auto vulkan = vk_instance(kWidth, kHeight);
    VkFrame frame(planes, canonical.frame);
    const ImageF expected = filtered(vulkan, made, frame);
    const HostImage color = HostImage::inside(VK_FORMAT_R32G32B32A32_SFLOAT, planes.at(Role::color),
                                              100, 60, 9, 5),
                    depth = HostImage::inside(VK_FORMAT_R32_SFLOAT, planes.at(Role::inverse_depth),
                                              90, 50, 3, 1),
                    motion = HostImage::inside(VK_FORMAT_R32G32_SFLOAT, planes.at(Role::motion), 80,
                                               44, 2, 3),
                    output = HostImage::inside(VK_FORMAT_R32G32B32A32_SFLOAT,
                                               ImageF(kWidth, kHeight, 4, 55), 99, 63, 11, 13);
    frame.vk.color = color;
    frame.vk.depth = depth;
    frame.vk.motion = motion;
    frame.vk.output = output;
    frame.frame.width = kWidth;
    frame.frame.height = kHeight;
    filtered(vulkan, made, frame);
    const auto around = HostImage::inside(VK_FORMAT_R32G32B32A32_SFLOAT, expected, 99, 63, 11, 13);
    EXPECT_TRUE(equal_bits(output.read(), around.read()));
}

// The texel of an exposure image is a factor, as a frame's pre_exposure divides.
TEST(Formats, ExposureIsReadOnTheDevice) {
    const auto canonical = canonical_frame(kWidth, kHeight);
    const auto made = chain("fxaa");
    const auto vulkan = vk_instance(kWidth, kHeight);
    VkFrame frame(canonical.test.planes, canonical.frame);
    frame.frame.pre_exposure = 0.5f;
    const ImageF expected = filtered(vulkan, made, frame);
    frame.frame.pre_exposure = 0;
    const HostImage exposure(VK_FORMAT_R32_SFLOAT, ImageF(1, 1, 1, 2.0f));
    frame.vk.exposure = exposure;
    EXPECT_TRUE(equal_bits(filtered(vulkan, made, frame), expected));
}

}  // namespace
}  // namespace postchain::test::formats_test
