// Flicker and grid of a chain on one frame, against the definitions implemented here.
#include "tools/measure/experiment/temporal_stability.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "tests/measure/experiment/support.h"
#include "tests/support/images.h"
#include "tests/support/status.h"

namespace postchain::experiment {

using namespace report;
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

TEST(GridShifts, AreSpreadOverTheTile) {
    EXPECT_THAT(grid_shifts(40, 640, 360), ElementsAre(5, 15, 25, 35));
    EXPECT_THAT(grid_shifts(4, 640, 360), ElementsAre(1, 2, 3));
    EXPECT_THAT(grid_shifts(2, 640, 360), ElementsAre(1));
    EXPECT_THAT(grid_shifts(1, 640, 360), IsEmpty());
    EXPECT_THAT(grid_shifts(0, 640, 360), IsEmpty());
    // Below a quarter of the shorter side, so that pixels remain between the margins.
    for (int side = 1; side < 200; ++side) {
        const int margin = grid_margin_px(40, 1000, side);
        for (int shift : grid_shifts(40, 1000, side)) EXPECT_LT(2 * margin + shift, side);
    }
    EXPECT_THAT(grid_shifts(40, 3, 3), IsEmpty());
    EXPECT_EQ(grid_margin_px(40, 640, 360), 90);
    EXPECT_EQ(grid_margin_px(8, 640, 360), 24);
}

TEST(GridTile, IsTheLargestLatticeOfAPass) {
    for (const auto& [passes, tile] :
         {std::pair{"fxaa", 1},
          {"", 1},
          {"motion_blur: {mode: guertin, max_blur_px: 8}, fxaa: {}", 8},
          {"depth_of_field: {method: gilham}", 4},
          {"depth_of_field: {method: gilham}, motion_blur: {mode: guertin, max_blur_px: 3}", 4}})
        EXPECT_EQ(grid_tile_px(test::parse(concat("{postchain: 1, passes: [", passes, "]}"))), tile)
            << passes;
    Chain chain = test::parse(test::kChainText);
    test::append(chain, "vignette");
    EXPECT_EQ(grid_tile_px(chain), 0);
}

class Stability : public ::testing::Test {
  protected:
    void SetUp() override {
        const auto made = test::layered_frame(64, 40, {6, 2}, {-3, 1}, 7);
        frame_.description = made.description;
        planes_ = made.planes;
        frame_.planes = sequence::shared(made.planes);
    }
    ImageF color_of(const Chain& chain, const FramePlanes& planes) {
        return test::filter(chain, frame_.description, planes).at(Role::color);
    }
    TemporalStability measure(const Chain& chain) {
        return test::must(
            temporal_stability(chain, frame_, color_of(chain, planes_), {}, test::executor()));
    }
    sequence::SourceFrame frame_;
    FramePlanes planes_;  // belong to frame_
};

ImageF moved(const ImageF& image, int k) {
    return test::make_image(image.width, image.height, image.channels, [&](int x, int y, int c) {
        return image.at(std::max(0, x - k), std::max(0, y - k), c);
    });
}

// Tiles of 8: shifts 1 + (2 i + 1) 7 / 8 = 1, 3, 5, 7; the margin is a quarter of 40, less than
// three tiles.
TEST_F(Stability, GridIsTheMeanOverTheShifts) {
    const Chain chain = test::parse(test::kChainText);
    const ImageF plain = color_of(chain, planes_);
    double expected = 0;
    for (const int k : {1, 3, 5, 7}) {
        FramePlanes planes;
        for (const auto& [role, plane] : planes_) planes[role] = moved(plane, k);
        const ImageF there = color_of(chain, planes);
        double sum = 0;
        int count = 0;
        for (int y = 10 + k; y < 40 - 10; ++y) {
            for (int x = 10 + k; x < 64 - 10; ++x) {
                for (int c = 0; c < 3; ++c, ++count)
                    sum += std::abs(double(there.at(x, y, c)) - double(plain.at(x - k, y - k, c)));
            }
        }
        expected += sum / count / 4;
    }
    EXPECT_GT(expected, 1e-3);
    EXPECT_NEAR(*measure(chain).grid, expected, 1e-5 * expected);
}

// Seeds 0..3 by hand; sample standard deviation.
TEST_F(Stability, FlickerIsTheScatterOverFourSeeds) {
    std::vector<ImageF> pictures;
    for (const char* seed : {"0", "1", "2", "3"})
        pictures.push_back(color_of(
            test::parse(test::kChainText, {std::string("motion_blur.seed=") + seed}), planes_));
    double sum = 0;
    for (int y = 0; y < 40; ++y) {
        for (int x = 0; x < 64; ++x) {
            for (int c = 0; c < 3; ++c) {
                double mean = 0, squares = 0;
                for (const auto& picture : pictures) mean += double(picture.at(x, y, c)) / 4;
                for (const auto& picture : pictures)
                    squares += std::pow(double(picture.at(x, y, c)) - mean, 2);
                sum += std::sqrt(squares / 3);
            }
        }
    }
    const double expected = sum / (64 * 40 * 3);
    EXPECT_GT(expected, 1e-4);
    EXPECT_NEAR(*measure(test::parse(test::kChainText)).flicker, expected, 1e-4 * expected);
}

TEST_F(Stability, AFilterWithoutSeedsOrTilesHasNeither) {
    const auto found = measure(test::parse("postchain: 1\npasses: [fxaa]\n"));
    EXPECT_FALSE(found.flicker || found.grid);
}

}  // namespace
}  // namespace postchain::experiment
