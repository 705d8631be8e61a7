// Flicker and grid of a chain on one frame: which seeds and shifts. metrics/temporal_test.cpp has
// the definitions.
#include "tools/measure/experiment/temporal_stability.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/measure/experiment/support.h"
#include "tests/support/images.h"
#include "tests/support/status.h"
#include "tools/metrics/temporal.h"

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

// Tiles of 8: shifts 1 + (2 i + 1) 7 / 8 = 1, 3, 5, 7; the margin is a quarter of 40, less than
// three tiles.
TEST_F(Stability, GridIsTheMeanOverTheShifts) {
    const Chain chain = test::parse(test::kChainText);
    const auto plain = test::must(metrics::rgb_image_of(color_of(chain, planes_)));
    metrics::GridError expected(10);
    for (const int k : {1, 3, 5, 7}) {
        FramePlanes planes;
        for (const auto& [role, plane] : planes_) planes[role] = metrics::shifted(plane, k, k);
        const auto there = test::must(metrics::rgb_image_of(color_of(chain, planes)));
        ASSERT_TRUE(expected.add(there, plain, k, k).ok());
    }
    EXPECT_GT(*expected.mean(), 1e-3);
    EXPECT_NEAR(*measure(chain).grid, *expected.mean(), 1e-5 * *expected.mean());
}

// Seeds 0 to 3.
TEST_F(Stability, FlickerIsTheScatterOverFourSeeds) {
    metrics::Flicker expected;
    for (const char* seed : {"0", "1", "2", "3"}) {
        const Chain chain = test::parse(test::kChainText, {concat("motion_blur.seed=", seed)});
        const auto image = test::must(metrics::rgb_image_of(color_of(chain, planes_)));
        ASSERT_TRUE(expected.add(image).ok());
    }
    EXPECT_GT(*expected.mean(), 1e-4);
    EXPECT_NEAR(*measure(test::parse(test::kChainText)).flicker, *expected.mean(),
                1e-4 * *expected.mean());
}

TEST_F(Stability, AFilterWithoutSeedsOrTilesHasNeither) {
    const auto found = measure(test::parse("postchain: 1\npasses: [fxaa]\n"));
    EXPECT_FALSE(found.flicker || found.grid);
}

}  // namespace
}  // namespace postchain::experiment
