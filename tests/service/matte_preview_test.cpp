// Previews of chains with mattes, at full size and reduced.
#include <gtest/gtest.h>

#include <fstream>

#include "tests/command/frames.h"
#include "tests/service/support.h"
#include "tests/support/images.h"

namespace postchain::service {
namespace {

// Frames with mattes: "all" is 1, "none" 0 and "half" 0.5 everywhere, "checker" alternates between
// 1 and 0, "left" is 1 in the left half.
class MattePreviews : public test::ServiceTest {
  protected:
    void SetUp() override {
        ServiceTest::SetUp();
        test::FrameFile file;
        const auto matte = [&](const char* name, const std::function<float(int, int, int)>& value) {
            file.mattes[concat("mask.", name)] = test::make_image(kWidth, kHeight, 1, value);
        };
        matte("all", [](int, int, int) { return 1; });
        matte("none", [](int, int, int) { return 0; });
        matte("half", [](int, int, int) { return 0.5f; });
        matte("checker", [](int x, int y, int) { return float((x + y) % 2); });
        matte("left", [](int x, int, int) { return x < kWidth / 2 ? 1.0f : 0.0f; });
        test::write_sequence(root(), {1, 2, 3}, kWidth, kHeight, file);
        open();
    }
    // Two passes, so that one plane holds mattes of two names.
    static std::string chain(const std::string& blur, const std::string& fxaa) {
        const auto matte = [](const std::string& name) {
            return name.empty() ? "" : concat(R"("matte": "mask.)", name, "\"");
        };
        return concat(R"("chain": {"postchain": 1, "passes": [{"motion_blur": {)", matte(blur),
                      R"(}}, {"fxaa": {)", matte(fxaa), "}}]}");
    }
    ImageF preview(const std::string& chain, double scale) {
        const std::string asked =
            concat("{", chain, R"(, "input": "in.####.exr", "frame": 2, "scale": )", scale, "}");
        const Picture exr = picture(previewing(asked, {"image/x-exr"}));
        std::ofstream(root("preview.exr"), std::ios::binary) << exr.bytes;
        return test::read_color(root("preview.exr"));
    }
    static constexpr int kWidth = 48, kHeight = 32;
};

TEST_F(MattePreviews, AtItsSizeItIsWhatARunWrites) {
    const std::string held = chain("left", "half");
    done(submit(concat("{", held, R"(, "input": "in.####.exr", "frames": "2",
        "output": "out/o.####.exr"})")));
    const ImageF written = test::read_color(root("out/o.0002.exr")), shown = preview(held, 1);
    EXPECT_EQ(shown.data, written.data);
    const ImageF input = test::make_planes(kWidth, kHeight, 2).color;
    double moved = 0;
    for (int x = kWidth / 2; x < kWidth; ++x)
        moved = std::max(moved, double(std::abs(shown.at(x, 14, 0) - input.at(x, 14, 0))));
    EXPECT_GT(moved, 0.05) << "nothing is blurred where the matte is 0";
}

TEST_F(MattePreviews, ReducedTheMatteIsTheMeanOfWhatAPixelCovers) {
    const ImageF plain = preview(chain("", ""), 0.5), held = preview(chain("all", "all"), 0.5);
    ASSERT_EQ(held.width, kWidth / 2);
    EXPECT_EQ(preview(chain("none", "none"), 0.5).data, plain.data);
    // The mean of four input pixels each.
    const ImageF input = test::make_planes(kWidth, kHeight, 2).color;
    for (int y = 0; y < kHeight / 2; ++y)
        for (int x = 0; x < kWidth / 2; ++x)
            for (int c = 0; c < 4; ++c)
                ASSERT_NEAR(held.at(x, y, c),
                            (input.at(2 * x, 2 * y, c) + input.at(2 * x + 1, 2 * y, c) +
                             input.at(2 * x, 2 * y + 1, c) + input.at(2 * x + 1, 2 * y + 1, c)) /
                                4,
                            1e-6)
                    << x << " " << y;
    EXPECT_GT(test::largest_difference(held, plain), 0.05);
    const ImageF soft = preview(chain("half", "none"), 0.5);
    EXPECT_EQ(preview(chain("checker", "none"), 0.5).data, soft.data);
    EXPECT_GT(test::largest_difference(soft, plain), 0.01);
    EXPECT_GT(test::largest_difference(soft, held), 0.01);
    // FXAA leaves out the left half: each plane of the stack is reduced by itself.
    const ImageF left = preview(chain("left", "all"), 0.5);
    for (int y = 0; y < kHeight / 2; ++y)
        for (int x = 0; x < kWidth / 4; ++x)
            ASSERT_NEAR(left.at(x, y, 0), held.at(x, y, 0), 1e-6) << x << " " << y;
    EXPECT_GT(test::largest_difference(left, held), 0.05);
}

}  // namespace
}  // namespace postchain::service
