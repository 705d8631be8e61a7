// Findings in frames and sequences, the check of signs, and color in strips.
#include "tools/sequence/source/sequence_survey.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <limits>

#include "tests/command/frames.h"
#include "tools/sequence/run/inspect_frame.h"

namespace postchain::sequence::frame_scan_test {
namespace {

constexpr int kWidth = 50, kHeight = 41;

// Surfaces with edges, clear and partly covered pixels, and faults of every kind.
test::Planes odd_planes(int frame) {
    test::Planes planes = test::make_planes(kWidth, kHeight, frame);
    for (int y = 0; y < kHeight; ++y) {
        for (int x = 0; x < kWidth; ++x) {
            if (planes.depth.at(x, y) > 3 && (x + 2 * y) % 11 < 4) {
                planes.depth.at(x, y) = 1e10f;
                planes.color.at(x, y, 3) = (x + y) % 3 == 0 ? 0 : 0.5f;
            }
            if ((x * 7 + y * 3) % 13 == 0) planes.depth.at(x, y) *= 1.3f;
        }
    }
    const float nan = std::numeric_limits<float>::quiet_NaN();
    planes.color.at(20, 23, 1) = nan;
    planes.depth.at(3, 24) = nan;
    planes.depth.at(4, 30) = -1;
    planes.motion.at(40, 9, 0) = 12000;  // Cycles' sentinel
    planes.motion.at(41, 33, 1) = nan;
    return planes;
}

class FrameScan : public testing::Test {
  protected:
    FrameHeader open(int frame) {
        auto header = open_source_frame(settings_, {{Role::color, path(frame)}}, frame);
        EXPECT_TRUE(header.ok()) << header.status().message();
        return std::move(*header);
    }
    std::string path(int frame) const { return folder_.path(concat("f.", frame, ".exr")); }
    SourceFrame read(int frame) {
        auto read = read_source_frame(settings_, open(frame),
                                      {Role::inverse_depth, Role::motion, Role::motion_back},
                                      io::Keep::nothing);
        EXPECT_TRUE(read.ok()) << read.status().message();
        return std::move(*read);
    }

    test::TempFolder folder_;
    SourceSettings settings_;
};

TEST_F(FrameScan, FindsFaultsAndEdges) {
    test::write_frame(path(1), odd_planes(1));
    const FrameFindings found = read(1).findings;
    EXPECT_EQ(found.health.first_nonfinite, (std::array<int, 2>{20, 23}));
    EXPECT_GT(found.clear_edges, 10u);
    EXPECT_GT(found.edges.parts().depth, 0);
}

TEST_F(FrameScan, ColorInStripsIsThatOfTheFrame) {
    test::write_frame(path(1), odd_planes(1));
    const auto whole = read(1).planes.at(Role::color);
    for (int rows : {1, 5, 16, 41}) {
        std::vector<float> found;
        const auto strips =
            scan_source_frame(settings_, open(1), rows, [&](const FramePlanes& planes, int y) {
                EXPECT_EQ(found.size(), size_t(y) * kWidth * 4);
                const auto& color = planes.at(Role::color).data;
                found.insert(found.end(), color.begin(), color.end());
            });
        ASSERT_TRUE(strips.ok()) << strips.status().message();
        EXPECT_EQ(*strips, (kHeight + rows - 1) / rows);
        EXPECT_EQ(found, whole->data);
    }
}

TEST_F(FrameScan, SignsAreCheckedAtTheSamePlace) {
    test::FrameFile file;
    file.display = io::Window{2, 3, 60, 55};
    test::write_frame(path(1), odd_planes(1), file);
    file.origin_x = 5;
    file.origin_y = -4;
    test::write_frame(path(2), odd_planes(2), file);
    for (const DataWindow window : {settings_.data_window, DataWindow::keep}) {
        settings_.data_window = window;
        const SourceFrame frame = read(1), next = read(2);
        const SignCheck expected = check_signs(
            frame.planes,
            io::placed(*next.planes.at(Role::color), next.header.window, frame.header.window));
        const auto check = scan_signs(settings_, open(1), open(2));
        ASSERT_TRUE(check.ok()) << check.status().message();
        EXPECT_GT(check->pixels, 0u);
        EXPECT_EQ(check->pixels, expected.pixels);
        EXPECT_EQ(check->still_error, expected.still_error);
    }
    const FrameDescription there = describe(open(2));
    EXPECT_EQ(there.origin_x, 5 - 2);
    EXPECT_EQ(there.origin_y, -4 - 3);
}

TEST(Windows, OfUpTo16384PixelsASideFit) {
    for (const auto& [first, sides] : {std::pair(-20000, 16384), {-8000, 16384}, {100000, 16384}}) {
        const int last = first + sides - 1;
        EXPECT_TRUE(fits({first, 0, last, 0})) << first;
        EXPECT_TRUE(fits({0, first, 0, last})) << first;
        EXPECT_FALSE(fits({first, 0, last + 1, 0})) << first;
        EXPECT_FALSE(fits({0, first, 0, last + 1})) << first;
    }
    constexpr int kLow = std::numeric_limits<int>::min(), kHigh = std::numeric_limits<int>::max();
    EXPECT_FALSE(fits({kLow, 0, kHigh, 0}));
    EXPECT_FALSE(fits({0, kLow, 0, kHigh}));
}

// A cut is told by the usual change of adjacent frames, not by changes across frames without
// pixels.
TEST(Survey, AFrameThatCannotBeReadIsNoChange) {
    SequenceSurvey survey;
    const auto add = [&](int frame, float shown) {
        survey.add(frame, SourceFrame(), Thumbnail(ImageF(16, 9, 4, shown / (1 - shown))));
    };
    add(1, 0.1f);
    add(2, 0.11f);
    survey.add_failed(3, Status(StatusCode::input, "f.exr: damaged"));
    add(4, 0.5f);
    add(5, 0.51f);
    survey.add_failed(6, Status(StatusCode::input, "f.exr: damaged"));
    add(7, 0.9f);
    add(8, 0.7f);
    const auto found = survey.findings();
    ASSERT_EQ(found.size(), 3u);
    EXPECT_EQ(found.back().frame, 7);
    EXPECT_EQ(found.back().what,
              "the image changes 20 times as much as usual to frame 8: a cut? ({cuts=7})"_keyed);
}

TEST(Survey, NamesWhatMostFramesHaveOtherwise) {
    SequenceSurvey survey;
    const Thumbnail gray(ImageF(4, 3, 4, 0.5f));  // smaller than a thumbnail
    const auto add = [&](int frame, RoleSet planes, uint64_t nonfinite = 0, int display = 40) {
        SourceFrame source;
        source.description.width = source.description.height = 40;
        source.description.display_width = 40;
        source.description.display_height = display;
        source.description.planes = planes;
        source.description.bounds.min_inverse_depth = 0;
        source.findings.health.nonfinite_color = nonfinite;
        survey.add(frame, source, gray);
    };
    const RoleSet color = {Role::color};
    add(1, color);
    add(2, color, 1);
    add(3, color, 0, 50);
    add(4, color | RoleSet{Role::inverse_depth}, 2);
    std::string text;
    for (const auto& finding : survey.findings())
        text += concat(finding.frame, " ", finding.what, "\n");
    EXPECT_EQ(text,
              "2 1 pixel with NaN or Inf\n"
              "3 is 40x40 of 40x50; most are 40x40\n"
              "4 has inverse_depth, which most frames lack\n"
              "4 2 pixels with NaN or Inf\n");
    EXPECT_NE(survey.text().find("  sky in 1 of 4 frames\n"), std::string::npos) << survey.text();
    EXPECT_EQ(SequenceSurvey().text(), "");
    // Half of the frames are most.
    SourceFrame source;
    SequenceSurvey two;
    two.add(1, source, gray);
    source.description.planes = {Role::motion};
    two.add(2, source, gray);
    ASSERT_EQ(two.findings().size(), 1u);
    EXPECT_EQ(two.findings()[0].what, "has no motion");
    EXPECT_EQ(fault_of("damaged"), "damaged");
    EXPECT_EQ(fault_of("a.exr: chunk 3: damaged"), "chunk 3: damaged");
    // Eight of ten frames of 10 GiB each.
    const std::vector<int> ten = {0, 1, 2, 3, 4, 5, 6, 7, 8, 9};
    EXPECT_EQ(frames_to_survey(ten, uint64_t(10) << 30),
              (std::vector<int>{0, 1, 2, 3, 5, 6, 7, 9}));
    EXPECT_EQ(frames_to_survey(ten, 1), ten);
}

TEST(Survey, GivesRangesOfTheFramesThatCanBeRead) {
    SequenceSurvey survey;
    const auto add = [&](int frame, double speed, double nearest, double farthest, double color) {
        SourceFrame source;
        FrameDescription& description = source.description;
        description.width = description.display_width = 40;
        description.height = description.display_height = 30;
        description.planes = {Role::color, Role::inverse_depth, Role::motion};
        FrameBounds& bounds = description.bounds;
        bounds.max_speed_px = speed;
        bounds.max_inverse_depth = 1 / nearest;
        bounds.min_inverse_depth = farthest > 0 ? 1 / farthest : 0;  // 0: sky
        bounds.min_color = {0.5, -color, 0.25, -100};
        bounds.max_color = {1, color, 2 * color, 100};
        survey.add(frame, source, Thumbnail());
    };
    add(3, 2, 4, 16, 1);
    add(4, 5, 2, 0, 3);
    survey.add_failed(5, Status(StatusCode::input, "f.5.exr: damaged"));
    survey.add_failed(6, Status(StatusCode::input, "f.6.exr: damaged"));
    add(7, 3, 8, 32, 2);
    const io::Json json = survey.json();
    for (const auto& [key, value] :
         {std::pair("frames", "5"),
          {"first", "3"},
          {"last", "7"},
          {"readable", "3"},
          {"size", R"("40x30")"},
          {"planes", R"(["color","inverse_depth","motion"])"},
          {"sky_in_frames", "1"},
          {"max_speed_px", R"({"least":2.0,"most":5.0,"most_in_frame":4})"},
          {"nearest", R"({"least":2.0,"most":8.0,"most_in_frame":7})"},
          {"farthest", R"({"least":16.0,"most":32.0,"most_in_frame":7})"},
          {"min_color", R"({"least":-3.0,"most":-1.0,"most_in_frame":3})"},
          {"max_color", R"({"least":2.0,"most":6.0,"most_in_frame":4})"}})
        EXPECT_EQ(json.at(key).dump(), value) << key;
    EXPECT_EQ(survey.text(),
              "5 frames examined, 3 to 7: 40x30, color, inverse_depth, motion\n"
              "  largest speed 2 to 5 (frame 4) px a frame\n"
              "  nearest distance 2 to 8 (frame 7) scene units\n"
              "  farthest distance 16 to 32 (frame 7) scene units\n"
              "  sky in 1 of 3 frames\n"
              "  smallest color value -3 to -1 (frame 3)\n"
              "  largest color value 2 to 6 (frame 4)\n"
              "unusual frames:\n"
              "  frame 5 and 1 more: cannot be read: f.5.exr: damaged\n");
    EXPECT_TRUE(survey.failed());
}

// Means of cells; a cell has the pixels of its rows and columns.
TEST(Thumbnail, IsTheMeanOfEachCell) {
    const auto thumbnail = [](double left, double top) {
        ImageF color(33, 20, 4);
        for (int y = 0; y < color.height; ++y)
            for (int x = 0; x < color.width; ++x)
                for (int c = 0; c < 3; ++c)
                    color.at(x, y, c) = (x + 2 * y) % 5 == 0
                                            ? std::numeric_limits<float>::quiet_NaN()
                                            : float(x < 11  ? left
                                                    : y < 8 ? top
                                                            : 3);
        return Thumbnail(color);
    };
    const Thumbnail whole = thumbnail(1, 1);
    EXPECT_EQ(whole.difference(Thumbnail()), 0);
    // x / (1 + x): from 1/2 to 3/4, in a part of the image.
    EXPECT_NEAR(thumbnail(3, 1).difference(whole), 0.25 * 0.8 / 3, 0.01);
    EXPECT_NEAR(thumbnail(1, 3).difference(whole), 0.25 * 0.8 * 2 / 3 * 0.4, 0.01);
}

// More than 0.05 and more than four times the median of the changes.
TEST(Survey, ACutChangesMuchMoreThanUsual) {
    const auto found = [](const std::vector<float>& shown) {
        SequenceSurvey survey;
        for (size_t i = 0; i < shown.size(); ++i) {
            survey.add(int(i) + 1, SourceFrame(),
                       Thumbnail(ImageF(16, 9, 4, shown[i] / (1 - shown[i]))));
        }
        std::string text;
        for (const auto& one : survey.findings()) text += concat(one.frame, " ", one.what, "\n");
        return text;
    };
    EXPECT_EQ(found({.1f, .11f, .12f, .165f, .175f}), "");
    EXPECT_THAT(found({.1f, .11f, .12f, .175f, .185f}),
                testing::StartsWith("3 the image changes "));
    EXPECT_EQ(found({.1f, .12f, .14f, .21f, .23f}), "");
    EXPECT_THAT(found({.1f, .12f, .14f, .23f, .25f}),
                testing::StartsWith("3 the image changes 4.5 "));
    EXPECT_THAT(found({.1f, .1f, .1f, .2f, .2f}),
                testing::StartsWith("3 the image changes unlike elsewhere to frame 4"));
}

TEST_F(FrameScan, SignsAreCheckedAgainstTheNextFrameOfTheShot) {
    for (const int frame : {1, 2}) test::write_frame(path(frame), odd_planes(frame));
    RunSettings settings;
    settings.input = *io::InputSpec::parse(folder_.path("f.#.exr"));
    const auto are_checked = [&](const std::set<int>& cuts) {
        settings.source.cuts = cuts;
        SequenceSurvey survey;
        const auto found = inspect_frame(settings, {{Role::color, path(1)}}, 1, survey);
        EXPECT_TRUE(found.status.ok()) << found.status.message();
        return found.signs.has_value() && found.json.contains("sign_check");
    };
    EXPECT_TRUE(are_checked({}));
    EXPECT_FALSE(are_checked({1}));
    EXPECT_TRUE(are_checked({0, 2}));
}

}  // namespace
}  // namespace postchain::sequence::frame_scan_test
