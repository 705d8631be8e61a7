// The sample host (tools/samples/glfw) runs, and its window shows a blurred bar on a sharp wall.
#include <gtest/gtest.h>
#include <unistd.h>

#include <array>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

namespace {

constexpr int kWidth = 640, kHeight = 360;

std::vector<unsigned char> picture_after(int frames) {
    const auto path =
        std::filesystem::temp_directory_path() / ("glfw_host_" + std::to_string(getpid()) + ".ppm");
    // Leaks of the display's driver are not ours, and have no symbols once it is unloaded.
    const std::string command = std::string("ASAN_OPTIONS=detect_leaks=0 ") + WITH_DISPLAY + " " +
                                GLFW_HOST + " " + std::to_string(frames) + " " + path.string();
    EXPECT_EQ(std::system(command.c_str()), 0) << command;
    std::ifstream in(path, std::ios::binary);
    std::string kind;
    int width = 0, height = 0, most = 0;
    in >> kind >> width >> height >> most;
    in.get();
    EXPECT_EQ(width, kWidth);
    EXPECT_EQ(height, kHeight);
    std::vector<unsigned char> pixels(size_t(kWidth * kHeight * 3));
    in.read(reinterpret_cast<char*>(pixels.data()), std::streamsize(pixels.size()));
    EXPECT_TRUE(in.good());
    std::filesystem::remove(path);
    return pixels;
}

// Pixels that are neither the wall's nor the bar's own colors: between stripes and at edges.
int mixed(const std::vector<unsigned char>& pixels) {
    const std::array<std::array<int, 3>, 4> own = {
        {{13, 20, 31}, {38, 51, 64}, {230, 77, 26}, {255, 230, 153}}};
    int count = 0;
    for (size_t i = 0; i < pixels.size(); i += 3) {
        bool known = false;
        for (const auto& color : own) {
            int distance = 0;
            for (size_t c = 0; c < 3; ++c)
                distance = std::max(distance, std::abs(int(pixels[i + c]) - color[c]));
            known = known || distance <= 2;
        }
        count += !known;
    }
    return count;
}

TEST(GlfwHost, BlursWhatMoves) {
    // The first frame is a cut: antialiased, not blurred.
    const int sharp = mixed(picture_after(1)), blurred = mixed(picture_after(9));
    EXPECT_GT(sharp, 100);
    EXPECT_GT(blurred, 2 * sharp);
    EXPECT_LT(blurred, kWidth * kHeight / 4);
}

}  // namespace
