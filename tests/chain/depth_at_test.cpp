// The depth at a place of the frame.
#include "chain/pass/depth_at.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "tests/support/images.h"

namespace postchain::depth_at_test {
namespace {

FrameDescription frame_of(const ImageF& depth, int display_width, int origin_x = 0) {
    FrameDescription frame;
    frame.width = depth.width;
    frame.height = frame.display_height = depth.height;
    frame.display_width = display_width;
    frame.origin_x = origin_x;
    return frame;
}

// The place is one of the display window; the planes may be less of it or more.
TEST(DepthAt, IsThatOfThePlaceInTheDataWindow) {
    const ImageF depth =
        test::make_image(40, 20, 1, [](int x, int, int) { return 1.0f / float(x + 1); });
    const struct {
        int display_width, origin_x;
        Place place;
        float column;
    } rows[] = {{40, 0, {0.5, 0.5}, 21},
                {40, 0, {0.26, 1}, 11},
                {100, 30, {0.5, 0.5}, 21},
                {100, -30, {0, 0.5}, 31},
                {100, 80, {0, 0}, 2}};  // beyond the planes the nearest pixels
    const ImageF down =
        test::make_image(20, 40, 1, [](int, int y, int) { return 1.0f / float(y + 1); });
    for (const auto& [display_width, origin_x, place, column] : rows) {
        EXPECT_FLOAT_EQ(
            float(inverse_depth_at(depth, frame_of(depth, display_width, origin_x), place)),
            1 / column);
        FrameDescription frame = frame_of(down, 20);  // likewise of rows
        frame.display_height = display_width;
        frame.origin_y = origin_x;
        EXPECT_FLOAT_EQ(float(inverse_depth_at(down, frame, {place[1], place[0]})), 1 / column);
    }
}

// A thin thing across the window, and a pixel that is no number, do not move it.
TEST(DepthAt, IsTheMedianAround) {
    ImageF depth(21, 21, 1, 0.25f);
    for (int y = 0; y < 21; ++y) depth.at(10, y) = 4;
    EXPECT_EQ(inverse_depth_at(depth, frame_of(depth, 21), {0.5, 0.5}), 0.25);
    depth.at(9, 9) = std::numeric_limits<float>::quiet_NaN();
    depth.at(11, 9) = std::numeric_limits<float>::infinity();
    EXPECT_EQ(inverse_depth_at(depth, frame_of(depth, 21), {0.5, 0.5}), 0.25);
}

// As far to each side.
TEST(DepthAt, IsTheMedianOfASquare) {
    const struct {
        const char* side;
        bool (*is_near)(int x, int y);
    } cases[] = {{"left", [](int x, int) { return x < 10; }},
                 {"right", [](int x, int) { return x > 10; }},
                 {"top", [](int, int y) { return y < 10; }},
                 {"bottom", [](int, int y) { return y > 10; }}};
    for (const auto& [side, is_near] : cases) {
        const ImageF depth = test::make_image(
            21, 21, 1, [is_near = is_near](int x, int y, int) { return is_near(x, y) ? 4 : 0.25; });
        EXPECT_EQ(inverse_depth_at(depth, frame_of(depth, 21), {0.5, 0.5}), 0.25) << side;
    }
}

// The square ends at a border: 10 of its 15 pixels there are 0.25.
TEST(DepthAt, EndsAtTheBorders) {
    const struct {
        Place place;
        bool (*is_near)(int x, int y);
    } cases[] = {{{0, 0.5}, [](int x, int) { return x == 0 || x > 2; }},
                 {{1, 0.5}, [](int x, int) { return x == 20 || x < 18; }},
                 {{0.5, 0}, [](int, int y) { return y == 0 || y > 2; }},
                 {{0.5, 1}, [](int, int y) { return y == 20 || y < 18; }}};
    for (const auto& [place, is_near] : cases) {
        const ImageF depth = test::make_image(
            21, 21, 1, [is_near = is_near](int x, int y, int) { return is_near(x, y) ? 4 : 0.25; });
        EXPECT_EQ(inverse_depth_at(depth, frame_of(depth, 21), place), 0.25);
    }
}

// No number and a depth beyond infinity count as sky too.
TEST(DepthAt, SkyIsInfinitelyFar) {
    for (const float value : {0.0f, -1.0f, std::numeric_limits<float>::quiet_NaN(),
                              std::numeric_limits<float>::infinity()}) {
        ImageF sky(8, 8, 1, value);
        EXPECT_EQ(inverse_depth_at(sky, frame_of(sky, 8), {0.5, 0.5}), 0) << value;
        if (std::isfinite(value)) continue;
        sky.at(4, 4) = 0.25f;
        EXPECT_EQ(inverse_depth_at(sky, frame_of(sky, 8), {0.5, 0.5}), 0.25) << value;
    }
}

}  // namespace
}  // namespace postchain::depth_at_test
