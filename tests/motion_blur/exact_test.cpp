// Exact properties of any motion blur of this kind.

#include <array>
#include <cmath>

#include "passes/common/shutter.h"
#include "passes/motion_blur/guertin.h"
#include "tests/motion_blur/support.h"
#include "tests/support/status.h"

namespace postchain::test {
namespace {

// A bright point in uniform motion: its streak covers exactly the pixels within half of its path
// while the shutter is open, without gaps.
TEST(Exact, StreakLengthIsMotionTimesShutter) {
    for (const auto& [motion, shutter, half] :
         {std::tuple(24.0, 0.25, 3), {24.0, 0.5, 6}, {24.0, 1.0, 12}, {200.0, 0.5, 30}}) {
        for (const auto& [mx, my] : {std::pair(1, 0), {0, 1}, {1, 1}}) {
            BlurFrame frame(101, 101);
            frame.set_all_half_velocities(motion * mx / 4, motion * my / 4);
            frame.set_gray(50, 50, 1);
            const ImageF out = blurred(plain_blur({{"samples", int64_t(255)},
                                                   {"shutter_frames", shutter},
                                                   {"max_blur_px", int64_t(30)}}),
                                       frame);
            // The limit is one of length.
            const int reach = half == 30 && mx == my ? 21 : half;
            int lit = 0;
            for (int y = 0; y < 101; ++y)
                for (int x = 0; x < 101; ++x) lit += out.at(x, y) > 0;
            EXPECT_EQ(lit, 2 * reach + 1) << motion << " " << shutter;
            for (const int k : {-reach, 0, reach})
                EXPECT_GT(out.at(50 + k * mx, 50 + k * my), 0) << motion << " " << shutter;
        }
    }
}

// Vectors of 1e30 px are cut like any that are longer than max_blur_px.
TEST(Exact, HugeMotionIsCutAndNotIgnored) {
    for (const char* mode : {"guertin", "single", "inverse_warp"}) {
        const auto with = [&](float speed, float cross) {
            BlurFrame frame = random_frame(90, 70, 0, 1.5f, 44);
            for (int y = 20; y < 50; ++y)
                for (int x = 20; x < 60; ++x) {
                    frame.motion().at(x, y, 0) = speed;
                    frame.motion().at(x, y, 1) = cross;
                }
            return frame;
        };
        const Chain chain = blur({{"mode", mode}, {"max_blur_px", int64_t(16)}});
        const ImageF fast = blurred(chain, with(4000, 0));
        EXPECT_GT(compare(fast, with(0, 0).color(), 0.01).fraction, 0.1) << mode;
        for (const float speed : {1e18f, 1e30f, 3e38f})
            EXPECT_LE(compare(blurred(chain, with(speed, 0)), fast, 1e-4).fraction, 0.002)
                << mode << " " << speed;
        const Difference difference =
            compare(blurred(chain, with(1e30f, -1e30f)),
                    reference_stages_of(chain, with(1e30f, -1e30f)).at("color"), 1e-3);
        EXPECT_LE(difference.fraction, 0.01) << mode << ": " << difference.text;
    }
}

// The default follows the picture: a streak of 130 px at 1920 pixels is not cut, and at 640 the
// report's 40 px remain.
TEST(Exact, MaxBlurFollowsTheWidth) {
    FrameDescription frame;
    for (const auto& [width, tile, path] :
         {std::array{320, 40, 40}, std::array{640, 40, 80}, std::array{1920, 120, 240},
          std::array{3840, 240, 480}, std::array{16384, 512, 512}}) {
        frame.display_width = width;
        EXPECT_EQ(motion_blur::tile_px({}, frame), tile);
        EXPECT_EQ(inverse_warp::shutter_on(frame, {}).max_path_px, path);
    }
}

// The open time with the place and the row that it comes from; the streak only if it is known.
TEST(Exact, TheShutterThatIsUsed) {
    const auto used = [](const shutter::Parameters& parameters, const FrameDescription& frame) {
        std::string text;
        for (const UsedValue& value : shutter::used_values(parameters, frame))
            text += concat(text.empty() ? "" : ", ", value.key, " ", text_of(value.value), " ",
                           int(value.of), value.row == value.key ? "" : " " + value.row);
        return text;
    };
    FrameDescription frame;
    EXPECT_EQ(used({}, frame), "shutter_frames 0.5 2");
    frame.camera.shutter_frames = 0.25;
    frame.camera.shutter_position = ShutterPosition::center;
    EXPECT_EQ(used({}, frame), "shutter_frames 0.25 1");
    frame.camera.shutter_position = ShutterPosition::end;
    frame.bounds.max_speed_px = 30;
    frame.planes = {Role::color, Role::motion};
    EXPECT_EQ(used({}, frame),
              "shutter_frames 0.25 1, shutter_position end 1, longest_streak_px 7.5 3");
    EXPECT_EQ(used({.shutter_frames = 2}, frame),
              "shutter_frames 2 0, shutter_position end 1, longest_streak_px 60 3");
    EXPECT_EQ(used({.shutter_angle_deg = 180}, frame),
              "shutter_frames 0.5 0 shutter_angle_deg, shutter_position end 1, "
              "longest_streak_px 15 3");
    // The limit is exceeded by more than itself alone, and by no length that is not known.
    EXPECT_TRUE(shutter::exceeded_limits({}, frame, 7.5).empty());
    ASSERT_EQ(shutter::exceeded_limits({}, frame, 7.4).size(), 1u);
    EXPECT_EQ(shutter::exceeded_limits({}, frame, 7.4)[0].what, "length of a streak");
    EXPECT_EQ(shutter::exceeded_limits({}, frame, 7.4)[0].parameter, "max_blur_px");
    frame.camera.shutter_position = ShutterPosition::center;
    EXPECT_TRUE(shutter::exceeded_limits({}, frame, 3.75).empty());
    EXPECT_EQ(shutter::exceeded_limits({}, frame, 3.7).at(0).what, "half-length of a streak");
    frame.bounds.max_speed_px = FrameBounds::kUnknown;
    EXPECT_TRUE(shutter::exceeded_limits({}, frame, 7.4).empty());
}

// A fraction of the display's height: the same limit in pixels at this size, another at twice it.
TEST(Exact, MaxBlurIsAFractionOfTheHeight) {
    const BlurFrame frame = random_frame(121, 41, 38, 1.5f, 7);
    for (const char* mode : {"guertin", "inverse_warp"}) {
        const Chain by_fraction =
            plain_blur({{"mode", mode}, {"max_blur_fraction", 12.0 / frame.height()}});
        const Chain by_px = plain_blur({{"mode", mode}, {"max_blur_px", int64_t(12)}});
        EXPECT_TRUE(equal_bits(blurred(by_fraction, frame), blurred(by_px, frame))) << mode;
        FrameDescription larger = describe(frame.planes);
        larger.display_height *= 2;
        const auto pass = must(by_fraction.links[0].pass->resolve(larger));
        ASSERT_EQ(pass->exceeded_limits().size(), 1u) << mode;
        EXPECT_EQ(pass->exceeded_limits()[0].parameter, "max_blur_fraction");
        EXPECT_DOUBLE_EQ(pass->exceeded_limits()[0].limit_px, 24);
    }
}

}  // namespace
}  // namespace postchain::test
