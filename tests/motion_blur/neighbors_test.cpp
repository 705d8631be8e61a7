// mode: inverse_warp with neighboring frames, which show what is occluded in this frame.
#include <algorithm>
#include <cmath>

#include "tests/motion_blur/support.h"

namespace postchain::test::neighbors_test {
namespace {

constexpr int kWidth = 160, kHeight = 24, kBar = 20;
constexpr double kSpeed = 48;  // px per frame

// A bar before a pattern that moves in the opposite direction.
struct Scene {
    double pattern_speed = -8;  // px per frame
    double wave = 0;            // px per frame of vertical motion of the pattern
    bool strip = false;         // adds a static strip between them
    bool fence = false;         // replaces the bar by a fence that enters from the right
    bool plate = false;         // replaces the bar by a plate that enters from the right
    bool screen = false;        // adds a screen between them that exists while the shutter is open
    bool shadow = false;        // the bar's shadow follows it
    bool flap = false;      // replaces the pattern by a flap before nothing that becomes brighter
    bool mirrored = false;  // left and right
    bool sheet = false;     // replaces the bar by a sheet that stretches while the shutter is open
    int begin = 40, end = 120;  // columns of the error: beside and behind the bar
};
const Scene kTwoLayers;
const Scene kThreeLayers = {.pattern_speed = -80, .strip = true};
const Scene kWave = {.wave = 14};
const Scene kScreen = {.pattern_speed = 0, .screen = true};
const Scene kShadow = {.pattern_speed = 0, .shadow = true, .begin = 66};
const Scene kFence = {.pattern_speed = 0, .fence = true, .begin = 150, .end = kWidth};
const Scene kSheet = {.pattern_speed = 0, .sheet = true, .begin = 30, .end = 130};
const Scene kPlate = {.pattern_speed = 0, .plate = true, .begin = 140, .end = kWidth};

double pattern(double x, double y) {
    return 0.5 + 0.25 * std::sin(0.35 * x) + 0.25 * std::sin(0.2 * x + 0.9 * y);
}

struct Pixel {
    double gray, inverse_depth, speed;
};

// Surface at x at time t in frames.
Pixel at(const Scene& scene, double t, double x, double y) {
    if (scene.fence && std::fmod(x + kSpeed * (t + 5), 20) < 8) return {2, 2, -kSpeed};
    if (scene.plate && x >= 130 - kSpeed * t) return {2, 2, -kSpeed};
    if (scene.sheet && std::abs(t) < 0.5) {
        const double stretch = 2, from = 80 + (x - 80) / (1 + stretch * t);
        if (std::abs(from - 80) < 60)
            return {1.5 + 0.2 * std::sin(0.3 * from), 1.5, stretch * (from - 80)};
    }
    const double bar = 70 + kSpeed * t;
    if (!scene.fence && !scene.plate && !scene.sheet && x >= bar && x < bar + kBar)
        return {2, 2, kSpeed};
    if (scene.screen && std::abs(t) < 0.5 && x >= 44 && x < 116)
        return {1.5 + 0.05 * std::sin(0.7 * x), 1.5, 0};
    if (scene.flap) {
        const bool shown = x >= (y < 12 ? 56 : 68) && x < 104;
        return shown ? Pixel{(1.2 + 0.2 * std::sin(0.7 * x)) * (1 + 0.8 * t), 1.5, 0} : Pixel{};
    }
    if (scene.strip && x >= 66 && x < 92) return {1.2 + 0.2 * std::sin(0.7 * x), 1.5, 0};
    // The visible part of the pattern was at `from` at time 0.
    double from = x, before, speed;
    do {
        before = from;
        speed = scene.pattern_speed + scene.wave * std::sin(0.06 * from + 0.15 * y);
        from = x - speed * t;
    } while (std::abs(from - before) > 1e-6);
    if (!scene.shadow) return {pattern(from, y), 1, speed};
    const bool shadowed = x >= bar - 58 && x < bar - 18;
    return {(0.3 + 0.6 * pattern(from, y)) * (shadowed ? 0.3 : 1), 1, speed};
}

BlurFrame frame_at(const Scene& scene, double t) {
    BlurFrame frame(kWidth, kHeight);
    for (int y = 0; y < kHeight; ++y) {
        for (int x = 0; x < kWidth; ++x) {
            const Pixel pixel = at(scene, t, scene.mirrored ? kWidth - 1 - x : x, y);
            frame.motion().at(x, y, 0) = float(scene.mirrored ? -pixel.speed : pixel.speed);
            frame.depth().at(x, y) = float(pixel.inverse_depth);
            frame.set_gray(x, y, float(pixel.gray));
            if (pixel.inverse_depth == 0) frame.color().at(x, y, 3) = 0;
        }
    }
    return frame;
}

using Given = std::vector<Neighbor>;
const Given kBefore = {Neighbor::before}, kAfter = {Neighbor::after},
            kBoth = {Neighbor::before, Neighbor::after};

BlurFrame with_neighbors(const Given& neighbors, const Scene& scene = kTwoLayers) {
    BlurFrame frame = frame_at(scene, 0);
    for (const Neighbor neighbor : neighbors) {
        const BlurFrame other = frame_at(scene, neighbor == Neighbor::before ? -1 : 1);
        for (const auto& [role, plane] : other.planes)
            frame.planes[role_of(neighbor, role)] = plane;
    }
    return frame;
}

// RMS error against the image of a shutter open for half a frame.
double error_of(const ImageF& out, const Scene& scene = kTwoLayers) {
    constexpr int kTimes = 100;
    double sum = 0;
    int count = 0;
    for (int y = 0; y < kHeight; ++y) {
        for (int x = scene.begin; x < scene.end; ++x) {
            double truth = 0;
            for (int i = 0; i < kTimes; ++i)
                truth += at(scene, (i + 0.5) / kTimes * 0.5 - 0.25, x, y).gray / kTimes;
            sum += std::pow(out.at(x, y) - truth, 2);
            ++count;
        }
    }
    return std::sqrt(sum / count);
}

Chain warp(Values values = {}) {
    values.insert(values.begin(), {{"mode", "inverse_warp"}, {"path_px_per_time", 0.5}});
    return blur(values);
}

double error_with(const Given& neighbors, const Scene& scene) {
    return error_of(blurred(warp(), with_neighbors(neighbors, scene)), scene);
}

TEST(Neighbors, ShowWhatIsHidden) {
    const double alone = error_with({}, kTwoLayers), before = error_with(kBefore, kTwoLayers);
    for (const Given& given : {kBefore, kAfter, kBoth})
        EXPECT_LT(error_with(given, kTwoLayers), 0.7 * alone);
    const auto of_both = [](const char* neighbors) {
        return error_of(blurred(warp({{"neighbors", neighbors}}), with_neighbors(kBoth)));
    };
    EXPECT_EQ(of_both("none"), alone);
    EXPECT_EQ(of_both("before"), before);
}

TEST(Neighbors, HelpAndDoNoHarm) {
    struct Case {
        const char* why;
        Scene scene;
        double alone_most;                          // error without a neighbor
        double before_most, after_most, both_most;  // as a part of it; 0: not compared
    };
    const Case cases[] = {
        {"the strip shows the pattern behind it: that must not replace it", kThreeLayers, 1, 0.5,
         0.5, 0.5},
        {"neighbors show no screen, which this frame shows on both sides of the bar", kScreen, 0.03,
         1.001, 1.001, 1.001},
        {"steps through the sheet end beside the pixels that come to a place", kSheet, 1, 1.001,
         1.001, 1.001},
        {"the shadow of the frame after lies on what the bar hides in this one", kShadow, 0.035,
         0.9, 1.001, 0.9},
        {"a post of the fence comes from beyond the picture", kFence, 1, 0, 0.5, 0.5},
        {"all of the plate that the shutter sees is beyond the picture", kPlate, 0.02, 0, 0, 0}};
    for (const Case& one : cases) {
        SCOPED_TRACE(one.why);
        const double alone = error_with({}, one.scene);
        EXPECT_LT(alone, one.alone_most);
        const auto expect_below = [&](const Given& given, double part) {
            if (part > 0) {
                EXPECT_LT(error_with(given, one.scene), part * alone);
            }
        };
        expect_below(kBefore, one.before_most);
        expect_below(kAfter, one.after_most);
        expect_below(kBoth, one.both_most);
    }
    // The frame before shows what the plate covers.
    for (const auto& given : {kBefore, kBoth}) EXPECT_LT(error_with(given, kPlate), 0.02);
}

// Each place of the pattern has its own speed, so that a search approaches it step by step.
TEST(Neighbors, ShowWhatIsHiddenOfWhatStretches) {
    constexpr double kFewerSteps = 0.0370;  // two: 0.0385
    for (const auto& given : {kBefore, kAfter, kBoth})
        EXPECT_LT(error_with(given, kWave), kFewerSteps);
}

// A shadow has moved, or not, whatever the exposure.
TEST(Neighbors, AreComparedAtAnyExposure) {
    for (const Scene& scene : {kShadow, kTwoLayers}) {
        const auto filtered = [&](float exposure) {
            BlurFrame frame = with_neighbors(kBoth, scene);
            for (const Role role : {Role::color, Role::color_before, Role::color_after})
                for (size_t i = 0; i < frame.planes[role].data.size(); ++i)
                    if (i % 4 != 3) frame.planes[role].data[i] *= exposure;
            return blurred(warp(), frame);
        };
        const ImageF one = filtered(1);
        for (const float exposure : {0.05f, 1000.0f}) {
            const ImageF other = filtered(exposure);
            for (int y = 0; y < kHeight; ++y)
                for (int x = 0; x < kWidth; ++x)
                    ASSERT_NEAR(other.at(x, y) / exposure, one.at(x, y), 1e-5)
                        << exposure << " " << x << "," << y;
        }
    }
}

// The flap behind the bar is lit anew. A fill would show nothing.
TEST(Neighbors, CoverInAnotherLightToo) {
    for (const bool mirrored : {false, true})
        for (const Given& given : {kBefore, kAfter, kBoth}) {
            const BlurFrame frame = with_neighbors(given, {.flap = true, .mirrored = mirrored});
            const ImageF out = blurred(warp(), frame);
            for (int y = 0; y < kHeight; ++y)
                for (int x = 70; x < 90; ++x)
                    EXPECT_GT(out.at(mirrored ? kWidth - 1 - x : x, y, 3), 0.97) << x << "," << y;
            expect_reference(warp(), frame, 0.01);
        }
}

// Everything rests: stripes of a wall before the ground, and in this frame the wall alone.
TEST(Neighbors, AreMarkedAtEdgesAndWhereThisFrameHidesThem) {
    constexpr int kWide = 70, kHigh = 67;  // several work groups, and squares cut by the border
    const auto is_wall = [](int x, int y) {
        return (std::clamp(x, 0, kWide - 1) + 2 * std::clamp(y, 0, kHigh - 1)) % 23 < 9;
    };
    BlurFrame frame(kWide, kHigh), neighbor(kWide, kHigh);
    ImageF expected((kWide + 3) / 4, (kHigh + 3) / 4, 1);
    std::vector<uint32_t> marks(expected.pixels());
    for (int y = 0; y < kHigh; ++y)
        for (int x = 0; x < kWide; ++x) {
            const bool wall = is_wall(x, y);
            if (!wall) neighbor.depth().at(x, y) = 0.1f;
            const bool edge = is_wall(x - 1, y) != wall || is_wall(x + 1, y) != wall ||
                              is_wall(x, y - 1) != wall || is_wall(x, y + 1) != wall;
            marks[size_t(y / 4 * expected.width + x / 4)] |=
                (uint32_t(edge) | uint32_t(!wall) << 16) << (y % 4 * 4 + x % 4);
        }
    // The bits are read as numbers: of the pixels that are hidden, and half of those at edges.
    std::copy(marks.begin(), marks.end(), expected.data.begin());
    for (const Neighbor side : kNeighbors)
        for (const auto& [role, plane] : neighbor.planes) frame.planes[role_of(side, role)] = plane;
    FrameDescription description = describe(frame.planes);
    description.bounds = {};  // a plan for frames that may move
    const auto stages =
        filter_with_stages(warp(), description, frame.planes, on_device({.elide = false})).stages;
    for (const char* name : {"marks_before", "marks_after"})
        EXPECT_TRUE(equal_bits(stages.at(concat("0.motion_blur.", name)), expected)) << name;
}

// For a shutter that hardly opens, paths do not reach neighboring frames.
TEST(Neighbors, AreNotAskedByAShortShutter) {
    const BlurFrame both = with_neighbors(kBoth);
    const Chain chain = warp({{"shutter_frames", 0.1}});
    EXPECT_FALSE(make_plan(chain, describe(both.planes))->reads.has(Role::color_before));
    EXPECT_TRUE(make_plan(warp(), describe(both.planes))->reads.has(Role::color_before));
}

}  // namespace
}  // namespace postchain::test::neighbors_test
