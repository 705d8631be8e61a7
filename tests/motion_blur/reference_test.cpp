// GPU against the double-precision reference at every stage boundary.
//
// Bounds. fp32 tile stages: 1e-5 of max(1, |value|), every pixel. fp16 and unorm8 velocities: one
// step of the storage, and at most 0.2 % of the pixels different (a value between two codes may
// round either way). Color: 1e-4 (1.1e-3 for color in half) on all but 0.2 % of the pixels: a tap
// within rounding of a pixel border, or a random number within rounding of its threshold, may go
// either way.

#include <cstdio>

#include "tests/motion_blur/support.h"

namespace postchain::test {
namespace {

constexpr double kFew = 0.002;

struct Case {
    std::string name;
    Values values;
    Precision precision = Precision::fp32;
    double velocity_step = 0;  // of the storage; 0 = fp32
    double color_bound = 1e-4;
};

std::vector<Case> cases() {
    const std::pair<std::string, ParameterValue> r16 = {"max_blur_px", int64_t(16)};
    const auto plain = [&](Values more) {
        Values values = {{"jitter", 0.0}, {"tile_jitter", false}, r16};
        values.insert(values.end(), more.begin(), more.end());
        return values;
    };
    const auto jittered = [&](Values more) {
        Values values = {r16};
        values.insert(values.end(), more.begin(), more.end());
        return values;
    };
    return {
        {"plain", plain({})},
        {"defaults", {}},
        {"jittered", jittered({})},
        {"single", jittered({{"mode", "single"}})},
        {"variance", jittered({{"sample_split", "variance"}})},
        {"ign", jittered({{"noise", "ign"}, {"seed", int64_t(3)}})},
        {"blue", jittered({{"noise", "blue"}, {"seed", int64_t(99)}, {"animate_noise", true}})},
        {"no noise", jittered({{"noise", "none"}})},
        {"clamp", jittered({{"border", "clamp"}})},
        {"dominant", plain({{"static_direction", "dominant"}, {"variance_threshold_px", 6.0}})},
        {"softness 20", plain({{"depth_softness", 20.0}})},
        {"softness 0", plain({{"depth_softness", 0.0}})},
        {"angle", plain({{"shutter_angle_deg", 77.0}, {"center_weight", 3.0}})},
        {"one tap", jittered({{"samples", int64_t(1)}})},
        {"slope", jittered({{"tile_jitter_slope", 0.2}, {"samples", int64_t(9)}})},
        {"fp16", jittered({}), Precision::fp16, 0, 1.1e-3},
        {"fp32 velocity", plain({{"velocity_storage", "fp32"}})},
        {"fp16 velocity", plain({{"velocity_storage", "fp16"}}), Precision::fp32,
         0x1p-7},  // quantum of 8 .. 16 px
        {"unorm8", plain({{"velocity_storage", "unorm8"}}), Precision::fp32, 1 / 255.0},
        {"min speed", jittered({{"min_speed_px", 9.0}})},
    };
}

void expect_equal(const Case& one, const BlurFrame& frame, const char* scene) {
    const Chain chain = blur(one.values);
    const auto gpu = stages_of(chain, frame, one.precision);
    const auto cpu = reference_stages_of(chain, frame, one.precision);
    ASSERT_EQ(gpu.size(), cpu.size()) << one.name;
    for (const auto& [name, stage] : gpu) {
        ASSERT_TRUE(cpu.count(name)) << one.name << " " << name;
        const std::string where = one.name + ", " + scene + ", " + name + ": ";
        const bool colored = name == "color" || name == "hint";
        const double bound = name == "color" ? one.color_bound : 1e-5;
        const Difference d = compare(stage, cpu.at(name), bound);
        if (colored || one.velocity_step > 0) {
            EXPECT_LE(d.fraction, kFew) << where << d.text;
        } else {
            EXPECT_EQ(d.fraction, 0) << where << d.text;
        }
        if (one.velocity_step > 0 && name == "half_velocity") {
            EXPECT_LE(d.max, 1.01 * one.velocity_step) << where << d.text;
        }
        if (name == "color")
            std::printf("  %-14s %-8s color: largest difference %.2g, %.3f %% above %.1g\n",
                        one.name.c_str(), scene, d.max, 100 * d.fraction, bound);
    }
}

// Every pixel has its own velocity, up to 28 px (clamped to 16), some nearly still.
TEST(GpuAgainstReference, RandomMotion) {
    BlurFrame frame = random_frame(101, 67, 20, 1.3f, 11);
    for (int y = 0; y < 67; ++y)
        for (int x = 0; x < 101; ++x)
            if ((x + 2 * y) % 7 == 0)
                for (int c = 0; c < 2; ++c) frame.motion().at(x, y, c) *= 0.03f;
    for (const Case& one : cases()) expect_equal(one, frame, "random");
}

// A near square over far ground, each with one motion; a still strip; sky above.
TEST(GpuAgainstReference, LayeredMotion) {
    const TestFrame layered = layered_frame(131, 89, {41.3f, -17.7f}, {-9.1f, 3.3f});
    BlurFrame frame(131, 89);
    frame.planes = layered.planes;
    for (int y = 0; y < 89; ++y) {
        for (int x = 0; x < 131; ++x) {
            if (y < 10) frame.depth().at(x, y) = 0;
            if (y < 10 || x < 30) frame.motion().at(x, y, 0) = frame.motion().at(x, y, 1) = 0;
        }
    }
    for (const Case& one : cases()) expect_equal(one, frame, "layered");
}

TEST(GpuAgainstReference, AnySize) {
    const std::pair<int, int> sizes[] = {{1, 1},  {1, 5},   {7, 3},     {41, 1},   {40, 40},
                                         {2, 81}, {97, 89}, {16384, 3}, {3, 16384}};
    for (auto [width, height] : sizes) {
        const BlurFrame frame = random_frame(width, height, 14, 2, 5);
        const std::string size = concat(width, "x", height);
        expect_equal({"defaults", {}}, frame, size.c_str());
    }
    // One-pixel tiles on the widest image: as many tiles as pixels.
    const BlurFrame wide = random_frame(16384, 2, 3, 2, 6);
    expect_equal({"r 1", {{"max_blur_px", int64_t(1)}, {"samples", int64_t(3)}}}, wide, "16384x2");
    const BlurFrame small = random_frame(33, 20, 9, 2, 7);
    expect_equal({"r 1024", {{"max_blur_px", int64_t(1024)}}}, small, "33x20");
}

}  // namespace
}  // namespace postchain::test
