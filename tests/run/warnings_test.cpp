// What a run says of a frame: faulty values of its planes, and parts of the result that limits cut.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "tests/run/fixture.h"
#include "tools/sequence/run/device.h"

namespace postchain::sequence::warnings_test {
namespace {

using test::FrameFile;
using test::Planes;
using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::Not;

constexpr float kInf = std::numeric_limits<float>::infinity();

class WarningsTest : public SequenceTest {
  protected:
    void SetUp() override {
        SequenceTest::SetUp();
        settings_.on_existing = io::OnExisting::overwrite;
        chain_ = test::chain_of("motion_blur", {{"mode", "guertin"}, {"shutter_frames", 0.5}});
    }
    // A chain of depth of field with a lens, without a focus.
    void focus(test::Settings settings) {
        chain_ = test::chain_of("depth_of_field", settings);
        chain_.camera.focal_length_mm = 50;
        chain_.camera.sensor_width_mm = 36;
        chain_.camera.f_stop = 1.4;
    }
    FrameReport report_on(const Planes& planes, const FrameFile& file = {}) {
        test::write_frame(in(1), planes, file);
        const FrameReport report = last_frame();
        EXPECT_TRUE(report.status.ok()) << report.status.message();
        for (const float value : test::read_color(out(1)).data) EXPECT_TRUE(std::isfinite(value));
        return report;
    }
    Planes planes_ = test::make_planes(48, 32);
};

// tests/chain has every kind.
TEST_F(WarningsTest, FaultyValuesAreCountedByKind) {
    planes_.color.at(20, 3, 0) = NAN;
    planes_.color.at(22, 3, 1) = 3e38f;  // no mean of such colors would fit a float
    planes_.depth.at(5, 2) = NAN;
    planes_.depth.at(9, 9) = -1;
    planes_.motion.at(7, 9, 1) = NAN;
    planes_.motion.at(9, 9, 0) = 12000;  // Cycles' sentinel
    FrameFile file;
    file.origin_x = -10;
    file.origin_y = -4;
    const FrameReport report = report_on(planes_, file);
    EXPECT_EQ(report.findings.health.nonfinite_color, 2u);
    EXPECT_EQ(report.findings.health.nonfinite_depth, 1u);
    EXPECT_EQ(report.findings.health.nonfinite_motion, 1u);
    EXPECT_EQ(report.findings.health.negative_depth, 1u);
    EXPECT_EQ(report.findings.health.sentinel_motion, 1u);
    // Pixel (5, 2) of the planes is (-5, -2) of the file.
    EXPECT_EQ(report.findings.health.first_nonfinite, (std::array<int, 2>{-5, -2}));
    EXPECT_EQ(report.output_nonfinite, 0u);
}

TEST_F(WarningsTest, VectorsThatSayNothingAndDepthThatIsCoarse) {
    EXPECT_TRUE(report_on(planes_).warnings.empty());
    FrameFile half_depth;
    half_depth.depth_type = io::PixelType::half;
    EXPECT_THAT(report_on(planes_, half_depth).warnings, Contains(HasSubstr("half float")));
    for (const float value : {0.0f, 10000.0f}) {
        planes_.motion = planes_.back = ImageF(48, 32, 2, value);
        EXPECT_THAT(report_on(planes_).warnings,
                    Contains(HasSubstr("every motion vector is zero")));
    }
}

// A sun that a half cannot hold stays the brightest thing of the image.
TEST_F(WarningsTest, InfiniteColorIsClampedOrZero) {
    std::fill_n(planes_.color.data.begin(), 4 * 48 * 8, kInf);
    const auto brightest = [&] {
        report_on(planes_);
        return std::ranges::max(test::read_color(out(1)).data);
    };
    EXPECT_GT(brightest(), 6e4f);
    settings_.source.nonfinite_color = NonfiniteColor::zero;
    EXPECT_LT(brightest(), 10.0f);
}

TEST_F(WarningsTest, CutStreaksAndCirclesAreCounted) {
    size_t fast = 0;  // half of a streak above 1 px at half a frame
    for (size_t i = 0; i < planes_.motion.pixels(); ++i)
        fast += std::hypot(planes_.motion.data[2 * i], planes_.motion.data[2 * i + 1]) > 4;
    ASSERT_GT(fast, 0u);
    EXPECT_THAT(report_on(planes_).warnings, Not(Contains(HasSubstr("is clamped to"))));
    chain_ = test::chain_of(
        "motion_blur", {{"mode", "guertin"}, {"shutter_frames", 0.5}, {"max_blur_px", int64_t(1)}});
    EXPECT_THAT(
        report_on(planes_).warnings,
        Contains(HasSubstr(concat(" ", fast, " pixels is clamped to 1 px; the largest is 1.677"))));
    focus({{"samples", int64_t(4)}, {"max_radius_px", 0.75}});
    chain_.camera.focus_distance = 2;
    chain_.camera.meters_per_unit = 0.05;
    EXPECT_THAT(report_on(planes_).warnings, Contains(HasSubstr("is clamped to 0.75 px")));
}

// A scene in centimeters, where a scene unit is assumed to be a meter, and other mixed units.
TEST_F(WarningsTest, FocusAndDepthInDifferentUnits) {
    const char* small = "a scene unit is assumed to be 1 m; if it is not, set meters_per_unit";
    const char* outside = "lies far outside the frame's depths, ";
    focus({{"samples", int64_t(4)}});
    struct Case {
        float scale;  // of depths of 2 and 6
        double focus;
        std::optional<double> meters_per_unit;
        const char* words;
        bool said;
    };
    const Case cases[] = {
        {100, 200, {}, small, true},
        {100, 200, 0.01, small, false},
        {0.05f, 0.1, {}, small, false},  // a scene in meters
        {1, 200, 0.05, "depth_of_field: the focus distance 200 lies far outside", true},
        {1, 200, 0.05, "the frame's depths, 2 to 6; are both in the same unit?", true},
        {100, 2, 0.05, outside, true},
        {1, 1.2, 0.05, outside, false},
        {1, 6, 0.05, outside, false},
        {1, 20, 0.05, outside, false},
    };
    for (const Case& one : cases) {
        SCOPED_TRACE(concat(one.scale, " ", one.focus, " ", one.words));
        Planes planes = planes_;
        for (float& depth : planes.depth.data) depth *= one.scale;
        chain_.camera.focus_distance = one.focus;
        chain_.camera.meters_per_unit = one.meters_per_unit;
        const std::vector<std::string> warnings = report_on(planes).warnings;
        EXPECT_EQ(testing::Value(warnings, Contains(HasSubstr(one.words))), one.said);
    }
    planes_.depth.at(3, 3) = 1e10f;  // the sky may be in focus
    chain_.camera.focus_distance = 200;
    EXPECT_THAT(report_on(planes_).warnings, Not(Contains(HasSubstr(outside))));
}

TEST_F(WarningsTest, VectorsFarBelowAPixelWhileColorChanges) {
    const auto slow = HasSubstr("but the next frame's color differs: are vectors fractions");
    const auto warnings = [&](float scale, int next) {
        for (const int frame : {1, 2}) {
            Planes planes = test::make_planes(48, 32, frame == 1 ? 1 : next);
            for (float& value : planes.motion.data) value *= scale;
            test::write_frame(in(frame), planes);
        }
        frames("1");
        const FrameReport report = last_frame();
        EXPECT_TRUE(report.status.ok()) << report.status.message();
        return report.warnings;
    };
    for (const char* mode : {"inverse_warp", "guertin"}) {  // reads neighbors, and not
        chain_ = test::chain_of("motion_blur", {{"mode", mode}});
        EXPECT_THAT(warnings(1 / 48.0f, 2), Contains(slow)) << mode;
        EXPECT_THAT(warnings(1, 2), Not(Contains(slow))) << mode;
        EXPECT_THAT(warnings(1 / 48.0f, 1), Not(Contains(slow))) << mode;  // nothing changes
        EXPECT_THAT(warnings(0, 2), Not(Contains(slow))) << mode;  // has a warning of its own
    }
}

// Discs before a wall, drawn with n x n samples a pixel.
TEST_F(WarningsTest, OneSampleAPixelBeforeFxaaOfBlurredPixels) {
    const auto drawn = [&](int n) {
        Planes planes = test::make_planes(192, 128, 1);
        for (int y = 0; y < 128; ++y)
            for (int x = 0; x < 192; ++x) {
                float light = 0.1f;
                for (int k = 0; k < n * n; ++k) {
                    const double dx = x + (k % n + 0.5) / n, dy = y + (k / n + 0.5) / n;
                    if (std::hypot(std::fmod(dx, 38.7) - 19, std::fmod(dy, 41.3) - 20) < 13)
                        light += 0.8f / float(n * n);
                }
                for (int c = 0; c < 3; ++c) planes.color.at(x, y, c) = light;
            }
        return planes;
    };
    const auto jagged = HasSubstr("of the edges are jagged, as with one sample a pixel");
    chain_ = test::chain_of("fxaa", {{"mode", "directional"}, {"where", "blurred"}});
    EXPECT_THAT(report_on(drawn(1)).warnings, Contains(jagged));
    EXPECT_THAT(report_on(drawn(4)).warnings, Not(Contains(jagged)));
    EXPECT_THAT(report_on(planes_).warnings, Not(Contains(jagged)));  // no edges to judge by
    chain_ = test::chain_of("fxaa", {{"mode", "directional"}});
    EXPECT_THAT(report_on(drawn(1)).warnings, Not(Contains(jagged)));
}

// `focus` in the file is in meters.
TEST_F(WarningsTest, AFocusOfTheFileNeedsTheLengthOfASceneUnit) {
    FrameFile file;
    file.attributes["focus"] = 0.1f;
    const auto unit = HasSubstr("meters_per_unit is unknown");
    EXPECT_THAT(report_on(planes_, file).warnings, Not(Contains(unit)));  // no pass needs it
    focus({{"samples", int64_t(4)}});
    EXPECT_THAT(report_on(planes_, file).warnings, Contains(unit));
    chain_.camera.meters_per_unit = 0.05;
    EXPECT_THAT(report_on(planes_, file).warnings, Not(Contains(unit)));
}

// Blocks of 8 x 8 pixels, those at the right and lower borders smaller.
TEST(ColorChange, IsTheMeanOfBlocks) {
    const ImageF before(20, 12, 4, 1);
    ImageF next = before;
    EXPECT_EQ(color_change(before, next), 0);
    // Three columns and two rows of blocks. The display's value of 3 is 3/4, of 1 it is 1/2.
    for (int y = 8; y < 12; ++y)
        for (int x = 16; x < 20; ++x) next.at(x, y, 1) = 3;
    EXPECT_NEAR(color_change(before, next), 0.25 / (6 * 3), 1e-9);
    EXPECT_NEAR(color_change(next, before), 0.25 / (6 * 3), 1e-9);
    // A move within a block is no change of it.
    next = before;
    next.at(3, 3, 0) = 3;
    ImageF moved = before;
    moved.at(4, 5, 0) = 3;
    EXPECT_NEAR(color_change(next, moved), 0, 1e-9);
    moved.at(4, 5, 0) = -7;  // as 0
    EXPECT_NEAR(color_change(before, moved), 0.5 / 64 / (6 * 3), 1e-9);
    EXPECT_NEAR(color_change(before, ImageF(9, 9, 4, 3)), 0.25, 1e-9);
    EXPECT_EQ(color_change(before, ImageF()), 0);
}

// Steps from light 0 to 1, displayed 0 and .707, with a pixel between them in every third one.
TEST(HardEdges, ArePartOfAllEdges) {
    for (const bool rows : {false, true}) {
        ImageF color(64, 64, 4);
        for (int line = 0; line < 64; ++line)
            for (int at = 0; at < 64; ++at) {
                const float light = at < 10 ? 0 : at < 20 ? 1 : at < 30 ? 0 : at == 30 ? 0.2f : 1;
                for (int c = 0; c < 3; ++c) color.at(rows ? line : at, rows ? at : line, c) = light;
            }
        ASSERT_TRUE(part_of_hard_edges(color));
        EXPECT_NEAR(*part_of_hard_edges(color), 2.0 / 3, 1e-9) << rows;
    }
    // A displayed step of .2 is an edge, and a smaller one is none: light of 1/24.
    const auto step = [](float light) {
        ImageF color(64, 64, 4);
        for (int y = 0; y < 64; ++y)
            for (int x = 32; x < 64; ++x)
                for (int c = 0; c < 3; ++c) color.at(x, y, c) = light;
        return part_of_hard_edges(color);
    };
    EXPECT_FALSE(step(1.f / 26));
    EXPECT_EQ(step(1.f / 22), 1);
}

// The file system of /proc has no room. Mesa's index there would end the process.
TEST(DeviceWarnings, AFullDiskLeavesOutTheCacheOfPrograms) {
    const auto said = [](const std::string& folder) {
        setenv("MESA_SHADER_CACHE_DIR", folder.c_str(), 1);
        std::string text;
        EXPECT_TRUE(
            choose_device("software", 0, [&](const std::string& line) { text += line; }).ok());
        return text;
    };
    const char* before = getenv("MESA_SHADER_CACHE_DIR");
    const std::string folder = before ? before : "";
    test::TempFolder room;
    EXPECT_EQ(said(room.path("not/made/yet")), "");
    EXPECT_EQ(getenv("MESA_SHADER_CACHE_DISABLE"), nullptr);
    EXPECT_THAT(said("/proc/none"), HasSubstr("/proc: the disk is full: compiled programs"));
    EXPECT_STREQ(getenv("MESA_SHADER_CACHE_DISABLE"), "true");
    unsetenv("MESA_SHADER_CACHE_DISABLE");
    before ? setenv("MESA_SHADER_CACHE_DIR", folder.c_str(), 1) : unsetenv("MESA_SHADER_CACHE_DIR");
}

}  // namespace
}  // namespace postchain::sequence::warnings_test
