// Edges that move or are out of focus, thin lines and hidden lights against exact ground truth.
// Each case prints its errors, in parts of the contrast. The limits are what the filter reaches.
#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cfloat>
#include <cmath>
#include <iostream>
#include <string>
#include <vector>

#include "tests/support/exact_scene.h"
#include "tests/support/gpu.h"

namespace postchain::test::edges_test {
namespace {

using namespace exact;

// A slanted line of 1 px.
std::vector<Span> slanted(double y) {
    if (y < 18 || y >= 42) return {};
    const double slope = 0.15, half = 0.5 * std::hypot(1, slope), x = 78 - slope * (y - 30);
    return {{x - half, x + half}};
}

struct Errors {
    double rms = 0, largest = 0;
};

// At the pixels of which the first surface covers from `least` to `most`, as parts of the contrast.
Errors errors_where(const Scene& scene, const ImageF& out, double least, double most) {
    const double contrast = std::abs(scene.surfaces.front().gray - scene.surfaces.back().gray);
    Errors errors;
    int count = 0;
    std::vector<double> truth;
    for (int y = 0; y < scene.height; ++y) {
        if (scene.surfaces[0].spans(y + 0.5).empty()) continue;
        const Row row = row_at(scene, y, 0);
        if (truth.empty() || scene.round) truth = truth_of(scene, y);
        for (size_t x = 0; x < kWidth; ++x) {
            if (row.shares[0][x] < least || row.shares[0][x] > most) continue;
            const double error = std::abs(out.at(int(x), y) - truth[x]) / contrast;
            errors.rms += error * error;
            errors.largest = std::max(errors.largest, error);
            ++count;
        }
    }
    errors.rms = std::sqrt(errors.rms / count);
    return errors;
}

Errors outline_errors(const Scene& scene, const ImageF& out) {
    return errors_where(scene, out, 1e-6, 1 - 1e-6);
}

Errors covered_errors(const Scene& scene, const ImageF& out) {
    return errors_where(scene, out, 1 - 1e-6, 1);
}

// rms: the part of the second surface's light that is missing where it should be.
Errors hidden_errors(const Scene& scene, const ImageF& out) {
    Scene without = scene;
    without.surfaces.erase(without.surfaces.begin() + 1);
    double seen = 0, all = 0;
    for (int y = 0; y < scene.height; ++y) {
        if (scene.surfaces[1].spans(y + 0.5).empty()) continue;
        const std::vector<double> truth = truth_of(scene, y), base = truth_of(without, y);
        for (size_t x = 0; x < kWidth; ++x) {
            const double light = std::max(truth[x] - base[x], 0.0);
            all += light;
            seen += std::clamp(out.at(int(x), y) - base[x], 0.0, light);
        }
    }
    return {1 - seen / all, 0};
}

// Amplitude of the wave in a block of 16 x 16 pixels.
double amplitude(const ImageF& image, int block_x, int block_y) {
    double mean = 0;
    for (int y = 16 * block_y; y < 16 * block_y + 16; ++y) {
        double sine = 0, cosine = 0;
        for (int x = 16 * block_x; x < 16 * block_x + 16; ++x) {
            sine += image.at(x, y) * std::sin(kWave * (x + 0.5)) / 8;
            cosine += image.at(x, y) * std::cos(kWave * (x + 0.5)) / 8;
        }
        mean += std::hypot(sine, cosine) / 16;
    }
    return mean;
}

// rms: how far the wave's amplitude is from the right one in the blocks two above the mover's;
// largest: how far apart the amplitudes are in all blocks above it.
Errors wave_errors(const Scene& scene, const ImageF& out) {
    const Surface& wall = scene.surfaces.back();
    const double path = wall.path(0.5), radius = std::abs(radius_of(scene, wall));
    const auto mean_over = [](double px) {
        return px > 0 ? std::sin(kWave * px / 2) / (kWave * px / 2) : 1;
    };
    const double spread =
        radius > 0 ? 2 * std::cyl_bessel_j(1.0, kWave * radius) / (kWave * radius) : 1;
    const double right = wall.wave * mean_over(1) * mean_over(path) * spread;
    Errors errors;
    double least = INFINITY, most = 0;
    for (int y = 0; y < 4; ++y)
        for (int x = 1; x < 8; ++x) {
            const double found = amplitude(out, x, y);
            if (y < 2) errors.rms = std::max(errors.rms, std::abs(found - right));
            least = std::min(least, found);
            most = std::max(most, found);
        }
    errors.largest = most - least;
    return errors;
}

struct Case {
    const char* name;
    Scene scene;
    Errors (*errors)(const Scene&, const ImageF&);
    double rms, largest;
};

void PrintTo(const Case& one, std::ostream* out) {
    *out << one.name;
}

Surface wall(double gray, double inverse_depth = 0.1) {
    return {everywhere, gray, inverse_depth};
}

// A surface at inverse depth 0.4 that moves before a still wall.
Scene before_wall(const Spans& spans, double gray, double wall_gray, double speed) {
    return {.surfaces = {{spans, gray, 0.4, steady(speed)}, wall(wall_gray)}};
}
Scene round_before_wall(const Spans& spans, double gray, double wall_gray, double speed) {
    Scene scene = before_wall(spans, gray, wall_gray, speed);
    scene.round = true;
    return scene;
}

// A still surface before a wall that moves, as seen by a camera that follows it.
Scene followed(const Spans& spans, double gray, double wall_gray, double wave = 0) {
    Scene scene = round_before_wall(spans, gray, wall_gray, 0);
    scene.surfaces.back().path = steady(44);
    scene.surfaces.back().wave = wave;
    return scene;
}

const Spans kDisc = discs({{78.3, 30.2}}, 12);
const Spans kLine = bar(78.5, 79.5);  // covers half of two pixels
// Inverse depths with a circle of confusion of 3.7 px.
constexpr double kNear = 0.25 + 3.7 / 32, kBehindFocus = 0.25 - 3.7 / 32;

Scene line_out_of_focus(double inverse_depth, double gray, double speed) {
    Surface line = {kLine, gray, inverse_depth, steady(speed)};
    const double wall_gray = gray > 0.1 ? 0.2 : 0.8;
    return {.surfaces = {line, wall(wall_gray, inverse_depth > 0.25 ? 0.25 : 0.05)}, .lens = true};
}

// A still bar, as a tripod shows it.
Scene still_bar(double inverse_depth, double wall_inverse_depth, bool alone) {
    return {.surfaces = {{bar(70.3, 86.6), 0.05, inverse_depth}, wall(0.8, wall_inverse_depth)},
            .lens = true,
            .alone = alone};
}

// A ball that a post hides at the frame's time alone. The camera may pan.
Scene hidden_ball(bool behind, double pan = 0) {
    const auto path = [pan](double speed, double inverse_depth) {
        return steady(speed - 40 * pan * inverse_depth);
    };
    return {.surfaces = {{bar(68, 88), 0.3, 0.5, path(0, 0.5)},
                         {discs({{78, 30}}, 8), 3, 0.25, path(60, 0.25)},
                         {everywhere, 0.2, 0.1, path(0, 0.1)}},
            .behind = behind,
            .round = true};
}

// Lamps that pickets hide at the frame's time alone, on a wall that moves less.
Scene hidden_lamps(double speed) {
    Surface back = wall(0.2);
    back.path = steady(0.6 * speed);
    return {.surfaces = {{fence(6, 8, 20), 0.1, 0.5, steady(50)},
                         {discs({{50.3, 22}, {70.3, 34}}, 1.6), 12, 0.17, steady(speed)},
                         back}};
}

// A lamp on a wall, beside a screen out of focus that hides the wall.
Scene lamp_beside_a_screen() {
    return {.surfaces = {{bar(-kFar, 73.2), 0.1, 0.5},
                         {discs({{78.2, 30.1}}, 2), 36, 0.25},
                         wall(0.6, 0.25)},
            .lens = true,
            .alone = true,
            .round = true};
}

// A bar out of focus that hides a part of a slanted stripe on a wall.
Scene stripe_behind_a_bar() {
    const auto stripe = [](double y) { return std::vector<Span>{{y + 30, y + 58}}; };
    return {.surfaces = {{bar(70.3, 82.3), 0.1, 0.5}, {stripe, 0.9, 0.25}, wall(0.3, 0.25)},
            .lens = true,
            .alone = true,
            .round = true};
}

// A bar out of focus that hides a half of a lit window in a wall.
Scene window_behind_a_bar() {
    return {.surfaces = {{bar(70.3, 82.3), 0.1, 0.5},
                         {bar(60.2, 76.3, 16, 44), 6, 0.25},
                         wall(0.3, 0.25)},
            .lens = true,
            .alone = true,
            .round = true};
}

// A wall of fine waves above a rail that moves or is out of focus further.
Scene wave(double speed, bool lens) {
    const double depth = lens ? 0.25 - 0.7 / 32 : 0.1, rail_depth = lens ? 0.25 + 5.0 / 32 : 0.5;
    Surface waves = {everywhere, 0.5, depth, steady(speed), 0.3};
    // The circle of confusion of the rail ends below the blocks.
    return {.surfaces = {{bar(40, 100, 70, 80), 0.4, rail_depth, steady(lens ? 0 : 60)}, waves},
            .lens = lens,
            .height = 93};
}

// Largest errors. The aim is 0.05 for outlines, 0.1 for lines, 0.3 for hidden lights and 0.01 for
// waves. Vectors of a line in the middle of two pixels are half its motion, and a renderer shows
// the depth of a column in some of its pixels only.
const std::vector<Case>& cases() {
    const auto bar_before_wall = [](double begin, double end, double gray) {
        return before_wall(bar(begin, end), gray, 0.8, 44);
    };
    static const std::vector<Case> all = {
        {"DarkDisc", round_before_wall(kDisc, 0.05, 0.8, 44), outline_errors, 0.015, 0.03},
        {"BrightDisc", round_before_wall(kDisc, 0.8, 0.05, 44), outline_errors, 0.015, 0.03},
        {"FaintDisc", round_before_wall(kDisc, 0.3, 0.5, 44), outline_errors, 0.015, 0.03},
        {"DarkBarOfThreeQuarters", bar_before_wall(75.25, 80.75, 0.05), outline_errors, 0.005,
         0.01},
        {"DimBarOfThreeQuarters", bar_before_wall(75.25, 80.75, 0.07), outline_errors, 0.005, 0.01},
        {"DarkBarOfHalves", bar_before_wall(75.5, 81.5, 0.05), outline_errors, 0.035, 0.06},
        {"BrightLine", before_wall(kLine, 2, 0.2, 60), outline_errors, 0.034, 0.035},
        {"DarkLine", before_wall(kLine, 0.05, 0.8, 60), outline_errors, 0.034, 0.035},
        {"DarkLineOfAThird", before_wall(bar(78.7, 79.7), 0.05, 0.8, 60), outline_errors, 0.025,
         0.06},
        {"DarkSlantedLine", round_before_wall(slanted, 0.05, 0.8, 60), outline_errors, 0.025, 0.06},
        {"BrightSlantedLine", round_before_wall(slanted, 2, 0.2, 60), outline_errors, 0.025, 0.06},
        {"SlowDarkDisc", round_before_wall(kDisc, 0.05, 0.8, 16), outline_errors, 0.025, 0.07},
        {"SlowBrightDisc", round_before_wall(kDisc, 0.8, 0.05, 16), outline_errors, 0.025, 0.07},
        {"SlowerDarkDisc", round_before_wall(kDisc, 0.05, 0.8, 8), outline_errors, 0.022, 0.062},
        {"SlowestDarkDisc", round_before_wall(kDisc, 0.05, 0.8, 4), outline_errors, 0.025, 0.09},
        {"SlowestBrightDisc", round_before_wall(kDisc, 0.8, 0.05, -4), outline_errors, 0.025, 0.09},
        {"SlowestDiscBetweenPixels", round_before_wall(discs({{78.8, 30.4}}, 12), 0.05, 0.8, -4),
         outline_errors, 0.025, 0.09},
        {"SlowDarkBar", before_wall(bar(78.1, 80.1), 0.05, 0.8, 16), outline_errors, 0.022, 0.03},
        {"SlowDarkBarOfHalves", before_wall(bar(78.5, 80.5), 0.05, 0.8, 16), outline_errors, 0.005,
         0.01},
        {"SlowBrightBar", before_wall(bar(78.1, 80.1), 2, 0.2, 16), outline_errors, 0.022, 0.03},
        {"SlowDarkLine", before_wall(bar(78.1, 79.1), 0.05, 0.8, 16), outline_errors, 0.022, 0.07},
        {"SlowDarkLineOfHalves", before_wall(kLine, 0.05, 0.8, 16), outline_errors, 0.12, 0.13},
        {"FollowedDarkDisc", followed(kDisc, 0.05, 0.8), outline_errors, 0.004, 0.02},
        {"FollowedBrightDisc", followed(kDisc, 0.8, 0.05), outline_errors, 0.004, 0.02},
        {"FollowedDiscBeforeWaves", followed(kDisc, 0.05, 0.8, 0.15), outline_errors, 0.024, 0.052},
        {"ColumnBeforeTheFocus", line_out_of_focus(kNear, 2, 0), outline_errors, 0.22, 0.34},
        {"ColumnBehindTheFocus", line_out_of_focus(kBehindFocus, 2, 0), outline_errors, 0.05, 0.09},
        {"BarBeforeTheFocus", still_bar(kNear, 0.25, false), outline_errors, 0.05, 0.24},
        {"BarInFocus", still_bar(0.25, kBehindFocus, false), outline_errors, 0.01, 0.01},
        {"BarBeforeTheFocusAlone", still_bar(kNear, 0.25, true), outline_errors, 0.01, 0.02},
        {"BarInFocusAlone", still_bar(0.25, kBehindFocus, true), outline_errors, 0.01, 0.01},
        {"LineBeforeTheFocus", line_out_of_focus(kNear, 2, 60), outline_errors, 0.05, 0.09},
        {"LineBehindTheFocus", line_out_of_focus(kBehindFocus, 2, 60), outline_errors, 0.05, 0.09},
        {"StillLampsBehindAFence", hidden_lamps(0), hidden_errors, 0.05, 0},
        {"MovingLampsBehindAFence", hidden_lamps(16), hidden_errors, 0.3, 0},
        {"BallBehindAPost", hidden_ball(false), hidden_errors, 0.3, 0},
        {"BallBehindAPostThatPasses", hidden_ball(false, 1), hidden_errors, 0.3, 0},
        {"BallInTheLayerBehind", hidden_ball(true), hidden_errors, 0.1, 0},
        {"LampBesideAScreen", lamp_beside_a_screen(), covered_errors, 0.02, 0.12},
        {"StripeBehindABar", stripe_behind_a_bar(), covered_errors, 0.16, 1.1},
        {"WindowBehindABar", window_behind_a_bar(), covered_errors, 2.2, 9.2},
        {"SlowWaves", wave(3, false), wave_errors, 0.014, 0.01},
        {"SlowestWaves", wave(1.6, false), wave_errors, 0.019, 0.01},
        {"WavesOutOfFocus", wave(0, true), wave_errors, 0.015, 0.01},
    };
    return all;
}

// With the samples and start surfaces of `best`.
Chain chain_for(const Scene& scene) {
    if (scene.alone)
        return chain_of("depth_of_field", {{"samples", int64_t(128)}, {"starts", int64_t(8)}});
    if (scene.lens)
        return chain_of("joint_blur", {{"samples", int64_t(128)}, {"starts", int64_t(8)}});
    return chain_of(
        "motion_blur",
        {{"samples", int64_t(127)}, {"path_px_per_time", 0.25}, {"starts", int64_t(8)}});
}

class Edges : public testing::TestWithParam<Case> {};

TEST_P(Edges, AreAsInGroundTruth) {
    const auto& [name, scene, errors, most_rms, most] = GetParam();
    const FramePlanes planes = frames_of(scene);
    const FrameDescription frame = description_of(scene, planes);
    const Errors found = errors(scene, filter(chain_for(scene), frame, planes).at(Role::color));
    std::cout << name << ": " << found.rms << ", largest " << found.largest << "\n";
    EXPECT_LE(found.rms, most_rms);
    EXPECT_LE(found.largest, most);
}

INSTANTIATE_TEST_SUITE_P(Of, Edges, testing::ValuesIn(cases()),
                         [](const auto& one) { return std::string(one.param.name); });

Difference to_reference(const Scene& scene, const char* neighbors = "both") {
    const FramePlanes planes = frames_of(scene);
    const FrameDescription frame = description_of(scene, planes);
    const Chain chain = chain_of(scene.alone ? "depth_of_field" : "joint_blur",
                                 {{"samples", int64_t(8)}, {"neighbors", std::string(neighbors)}});
    return compare(filter(chain, frame, planes, {.elide = false}).at(Role::color),
                   reference(chain, frame, planes, {.elide = false}).planes.at(Role::color), 1e-3);
}

// As the chain's reference, whose decisions may fall the other way in single pixels.
TEST(EdgesReference, AgreesOnOutlinesLinesAndHiddenLights) {
    for (const Scene& scene :
         {round_before_wall(kDisc, 0.05, 0.8, 44), round_before_wall(slanted, 2, 0.2, 60),
          round_before_wall(kDisc, 0.05, 0.8, 16), followed(kDisc, 0.05, 0.8),
          line_out_of_focus(kNear, 2, 60), still_bar(kNear, 0.25, false),
          still_bar(0.25, kBehindFocus, true), hidden_ball(false, 1), hidden_ball(true),
          hidden_lamps(16), lamp_beside_a_screen(), stripe_behind_a_bar(), window_behind_a_bar()}) {
        const Difference difference = to_reference(scene);
        EXPECT_LE(difference.fraction, 0.01) << difference.text;
    }
}

// The outline has 75 of 10,519 pixels.
TEST(EdgesReference, AgreesOnWhatACameraFollows) {
    for (const char* neighbors : {"both", "none"}) {
        const Difference difference = to_reference(followed(kDisc, 0.05, 0.8, 0.15), neighbors);
        EXPECT_LE(difference.fraction, 0.001) << difference.text;
    }
}

// Products of denormal numbers take a CPU many times as long. The places of colors are in the last
// bits of paths, also in those of a still wall. A stage holds bits as whole numbers.
TEST(EdgesStored, HaveNoDenormalPaths) {
    const Scene scene = round_before_wall(kDisc, 0.05, 0.8, 44);
    const FramePlanes planes = frames_of(scene);
    const ImageF surfaces =
        filter_with_stages(chain_of("joint_blur"), description_of(scene, planes), planes)
            .stages.at("0.joint_blur.surfaces");
    const auto bits_of = [](float path) { return double(std::bit_cast<uint32_t>(path)); };
    int still = 0;
    for (int y = 0; y < surfaces.height; ++y)
        for (int x = 0; x < surfaces.width; ++x) {
            const double bits = surfaces.at(x, y, 1);
            EXPECT_FALSE(bits > 0 && bits < bits_of(FLT_MIN)) << x << ", " << y;
            if (bits > 0 && bits < bits_of(1e-9F)) ++still;
        }
    EXPECT_GT(still, 0);
}

}  // namespace
}  // namespace postchain::test::edges_test
