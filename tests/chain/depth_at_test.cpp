// The depth at a place of the frame.
#include "chain/pass/depth_at.h"

#include <gtest/gtest.h>

#include <limits>

#include "tests/support/images.h"

namespace postchain::depth_at_test {
namespace {

FrameDescription frame_of(const ImageF& depth, int display_width, int display_height) {
    FrameDescription frame;
    frame.width = depth.width;
    frame.height = depth.height;
    frame.display_width = display_width;
    frame.display_height = display_height;
    return frame;
}

// 1/x of each column.
ImageF ramp(int width, int height) {
    return test::make_image(width, height, 1, [](int x, int, int) { return 1.0f / float(x + 1); });
}

TEST(DepthAt, IsThatOfThePlace) {
    const ImageF depth = ramp(40, 20);
    const FrameDescription frame = frame_of(depth, 40, 20);
    EXPECT_FLOAT_EQ(float(inverse_depth_at(depth, frame, {0.5, 0.5})), 1.0f / 21);
    EXPECT_FLOAT_EQ(float(inverse_depth_at(depth, frame, {0.26, 1})), 1.0f / 11);
}

// A thin thing across the window, and a pixel that is no number, do not move it.
TEST(DepthAt, IsTheMedianAround) {
    ImageF depth(21, 21, 1, 0.25f);
    for (int y = 0; y < 21; ++y) depth.at(10, y) = 4;
    depth.at(9, 9) = std::numeric_limits<float>::quiet_NaN();
    depth.at(11, 9) = std::numeric_limits<float>::infinity();
    EXPECT_EQ(inverse_depth_at(depth, frame_of(depth, 21, 21), {0.5, 0.5}), 0.25);
}

TEST(DepthAt, SkyIsInfinitelyFar) {
    const ImageF sky(8, 8, 1, 0);
    EXPECT_EQ(inverse_depth_at(sky, frame_of(sky, 8, 8), {0.5, 0.5}), 0);
}

// The place is one of the display window; the planes may be less of it or more.
TEST(DepthAt, KnowsWhereTheDataWindowIs) {
    const ImageF depth = ramp(40, 20);
    FrameDescription frame = frame_of(depth, 100, 20);
    frame.origin_x = 30;
    EXPECT_FLOAT_EQ(float(inverse_depth_at(depth, frame, {0.5, 0.5})), 1.0f / 21);
    frame.origin_x = -30;
    EXPECT_FLOAT_EQ(float(inverse_depth_at(depth, frame, {0, 0.5})), 1.0f / 31);
    // Beyond the planes the nearest pixels.
    frame.origin_x = 80;
    EXPECT_FLOAT_EQ(float(inverse_depth_at(depth, frame, {0, 0})), 1.0f / 2);
}

}  // namespace
}  // namespace postchain::depth_at_test
