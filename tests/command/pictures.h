// Non-EXR images, written and read back by OpenImageIO as stored, and runs over them.
#pragma once

#include <OpenImageIO/imageio.h>

#include <array>
#include <string>
#include <vector>

#include "tests/command/fixture.h"

namespace postchain::test {

struct Stored {
    int width = 0, height = 0, channels = 0;
    std::vector<float> values;  // integers divided by their type's maximum
};

struct Kind {
    const char* file;
    OIIO::TypeDesc type;
    int bits;
    int channels;
    bool unassociated = false;
    const char* space = "";
};
constexpr auto kByte = OIIO::TypeDesc::UINT8;
constexpr auto kShort = OIIO::TypeDesc::UINT16;
constexpr auto kFloat = OIIO::TypeDesc::FLOAT;

// Contains every 8- and 10-bit code, and a sixth of the 16-bit codes.
Stored noise_of(const Kind& kind, int width = 96, int height = 64);
void write_picture(const std::string& path, const Kind& kind, const Stored& picture);
// In the file's own type, alpha as stored.
Stored read_picture(const std::string& path, OIIO::ImageSpec* spec = nullptr);

class FormatsTest : public CommandTest {
  protected:
    void SetUp() override {
        CommandTest::SetUp();
        write_text(at("none.yaml"), "postchain: 1\npasses: []\n");
    }
    Outcome through(const std::string& in_name, const std::string& out_name, Arguments more = {}) {
        Arguments arguments = {
            "run",           at("none.yaml"), "-i", at(in_name), "-o", at("out/" + out_name),
            "--on-existing", "overwrite"};
        arguments.insert(arguments.end(), more.begin(), more.end());
        return run(arguments);
    }
    // An EXR of one row: R, G, B, A of each pixel.
    void write_exr(const std::string& name, const std::vector<std::array<float, 4>>& pixels) {
        ImageF image(int(pixels.size()), 1, 4);
        for (size_t i = 0; i < pixels.size(); ++i)
            for (int c = 0; c < 4; ++c) image.at(int(i), 0, c) = pixels[i][size_t(c)];
        ASSERT_TRUE(
            io::write_planes_exr(at(name), image, {"R", "G", "B", "A"}, io::OnExisting::overwrite)
                .ok());
    }
};

}  // namespace postchain::test
