// The sample host (tools/samples/vulkan) runs under the validation layer without a message, and its
// image shows a blurred disc on a wall out of focus.
#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>

#include "tests/support/temp_folder.h"
#include "tests/support/text_file.h"
#include "tests/vulkan/device.h"

namespace postchain::test::sample_test {
namespace {

TEST(Sample, WritesABlurredImage) {
    const TempFolder folder;
    const std::string image = folder.path("image.ppm"), log = folder.path("log");
    // Leaks of the driver are not ours, and have no symbols once it is unloaded.
    const std::string command =
        "ASAN_OPTIONS=detect_leaks=0 VK_INSTANCE_LAYERS=VK_LAYER_KHRONOS_validation " +
        std::string(VULKAN_HOST) + " 2 " + image + " >" + log + " 2>&1";
    EXPECT_EQ(std::system(command.c_str()), 0);
    EXPECT_EQ(read_text(log), "2 frames of 640x360\n");
    std::ifstream in(image, std::ios::binary);
    std::string kind;
    int width = 0, height = 0, most = 0;
    in >> kind >> width >> height >> most;
    in.get();
    ASSERT_EQ(width, 640);
    ASSERT_EQ(height, 360);
    std::vector<unsigned char> pixels(size_t(width) * size_t(height) * 3);
    in.read(reinterpret_cast<char*>(pixels.data()), std::streamsize(pixels.size()));
    ASSERT_TRUE(in.good());
    const auto red = [&](int x, int y) { return int(pixels[3 * size_t(y * width + x)]); };
    // The wall has red 13 and 38, far from the disc (at 176, 180 with a radius of 90) only where
    // the checkers meet between; the disc has 230.
    EXPECT_NEAR(red(176, 180), 230, Vulkan::get().software ? 0 : 1);
    int between = 0;
    for (int x = 400; x < 600; ++x) between += red(x, 170) > 16 && red(x, 170) < 35;
    EXPECT_GT(between, 10) << "the wall is sharp";
    // Its edge moves by 14 pixels in a frame, and is half as wide with the shutter half open.
    int edge = 0;
    for (int x = 200; x < 320; ++x) edge += red(x, 180) > 45 && red(x, 180) < 220;
    EXPECT_GT(edge, 4) << "the disc is sharp";
}

// A host of Vulkan links the plans, and neither libepoxy nor a GL library.
TEST(Sample, LinksNoGl) {
    const TempFolder folder;
    const std::string list = folder.path("libraries");
    ASSERT_EQ(std::system(("ldd " + std::string(VULKAN_HOST) + " >" + list).c_str()), 0);
    const std::string text = read_text(list);
    EXPECT_NE(text.find("libvulkan.so"), text.npos) << text;
    for (const char* library : {"libepoxy", "libGL", "libEGL", "libOpenGL"})
        EXPECT_EQ(text.find(library), text.npos) << text;
}

}  // namespace
}  // namespace postchain::test::sample_test
