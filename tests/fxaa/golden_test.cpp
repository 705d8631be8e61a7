// Golden results of original FXAA 3.11 on a rendered, display-referred image.
//
// tests/data/fxaa/input.rgbf is a crop of the image; preset_12.rgbf and preset_39.rgbf are FXAA
// 3.11's results for the interior of that crop (subpix 0.75, thresholds 0.166 and 0.0833, luma
// 0.299, 0.587, 0.114 of the stored values). The margin is wider than the longest search.
// A file is one line of text, "rgbf WIDTH HEIGHT", and the rows of little-endian floats.

#include <fstream>

#include "tests/fxaa/support.h"

namespace postchain::test {
namespace {

ImageF load(const std::string& name) {
    std::ifstream in(std::string(POSTCHAIN_SOURCE_DIR) + "/tests/data/fxaa/" + name,
                     std::ios::binary);
    std::string magic;
    int width = 0, height = 0;
    in >> magic >> width >> height;
    in.get();
    EXPECT_TRUE(in.good() && magic == "rgbf") << name;
    if (!in.good()) return {};
    ImageF rgb(width, height, 3);
    in.read(reinterpret_cast<char*>(rgb.data.data()),
            static_cast<std::streamsize>(rgb.data.size() * sizeof(float)));
    EXPECT_TRUE(in.good()) << name;
    return rgb;
}

TEST(Golden, EqualsOriginalFxaa) {
    const ImageF input = load("input.rgbf");
    ASSERT_FALSE(input.empty());
    ImageF color(input.width, input.height, 4, 1.0f);
    for (int y = 0; y < input.height; ++y)
        for (int x = 0; x < input.width; ++x)
            for (int c = 0; c < 3; ++c) color.at(x, y, c) = input.at(x, y, c);
    for (const int64_t preset : {12, 39}) {
        const ImageF golden = load("preset_" + std::to_string(preset) + ".rgbf");
        ASSERT_FALSE(golden.empty());
        const ImageF out = run(stored_settings({{"preset", preset}}), color);
        const int margin_x = (input.width - golden.width) / 2;
        const int margin_y = (input.height - golden.height) / 2;
        ImageF inner(golden.width, golden.height, 3);
        int moved = 0;
        for (int y = 0; y < golden.height; ++y) {
            for (int x = 0; x < golden.width; ++x) {
                for (int c = 0; c < 3; ++c)
                    inner.at(x, y, c) = out.at(x + margin_x, y + margin_y, c);
                moved +=
                    std::abs(golden.at(x, y, 1) - input.at(x + margin_x, y + margin_y, 1)) > 2e-4f;
            }
        }
        EXPECT_GT(moved, int(golden.pixels() / 5));  // the crop is demanding
        const Difference difference = compare(inner, golden, 2e-4);
        EXPECT_LE(difference.fraction, 0.001) << "preset " << preset << ": " << difference.text;
    }
}

}  // namespace
}  // namespace postchain::test
