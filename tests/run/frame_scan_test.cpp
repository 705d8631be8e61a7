// Scanning a frame strip by strip gives the findings of the whole frame.
#include "tools/sequence/source/sequence_survey.h"

#include <gtest/gtest.h>

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

// What a scan finds in a frame.
auto findings(const SourceFrame& frame) {
    const FrameDescription& d = frame.description;
    const auto& bounds = d.bounds;
    const auto& found = frame.findings;
    const auto& health = found.health;
    return std::tuple(bounds.max_speed_px, bounds.max_speed_back_px, bounds.min_inverse_depth,
                      bounds.max_inverse_depth, bounds.min_color, bounds.max_color,
                      bounds.one_color, bounds.color_is_half, health.nonfinite_color,
                      health.nonfinite_depth, health.nonfinite_motion, health.sentinel_motion,
                      health.negative_depth, health.motion_all_zero, health.first_nonfinite,
                      found.edges.parts().depth, found.edges.parts().motion, found.clear_edges,
                      found.sky.without_motion(), d.width, d.height, d.origin_y, d.planes,
                      frame.warnings);
}

void expect_same(const SignCheck& a, const SignCheck& b) {
    EXPECT_EQ(a.pixels, b.pixels);
    EXPECT_NEAR(a.still_error, b.still_error, 1e-12);
    ASSERT_EQ(a.candidates.size(), b.candidates.size());
    for (size_t i = 0; i < a.candidates.size(); ++i) {
        EXPECT_EQ(a.candidates[i].text(), b.candidates[i].text());
        EXPECT_EQ(a.candidates[i].pixels_apart, b.candidates[i].pixels_apart);
        EXPECT_NEAR(a.candidates[i].error, b.candidates[i].error, 1e-12);
        EXPECT_NEAR(a.candidates[i].margin, b.candidates[i].margin, 1e-12);
    }
}

class FrameScan : public testing::Test {
  protected:
    FrameHeader open(int frame) {
        auto header = open_source_frame(settings_, {{Role::color, path(frame)}}, frame);
        EXPECT_TRUE(header.ok()) << header.status().message();
        return std::move(*header);
    }
    std::string path(int frame) const { return folder_.path(concat("f.", frame, ".exr")); }
    void expect_like_the_whole() {
        const RoleSet wanted = {Role::inverse_depth, Role::motion, Role::motion_back};
        const auto whole = read_source_frame(settings_, open(1), wanted, io::Keep::nothing);
        const auto next = read_source_frame(settings_, open(2), {}, io::Keep::nothing);
        ASSERT_TRUE(whole.ok() && next.ok());
        SignChecker checker;
        checker.add(
            whole->planes, Strip::whole(whole->header.window.height()),
            io::placed(*next->planes.at(Role::color), next->header.window, whole->header.window),
            0);
        const SignCheck signs = checker.result();
        for (int rows : {1, 2, 5, 16, 40, 41}) {
            SCOPED_TRACE(rows);
            const auto scanned = scan_source_frame(settings_, open(1), wanted, rows);
            ASSERT_TRUE(scanned.ok()) << scanned.status().message();
            EXPECT_TRUE(scanned->planes.empty());
            EXPECT_TRUE(findings(*scanned) == findings(*whole));
            const auto check =
                scan_signs(open(1), open(2), whole->description.bounds.max_speed_px, rows);
            ASSERT_TRUE(check.ok()) << check.status().message();
            expect_same(*check, signs);
        }
    }

    test::TempFolder folder_;
    SourceSettings settings_;
};

TEST_F(FrameScan, ShowsWhatTheWholeFrameShows) {
    test::write_frame(path(1), odd_planes(1));
    test::write_frame(path(2), odd_planes(2));
    expect_like_the_whole();
    const auto found = scan_source_frame(settings_, open(1),
                                         {Role::inverse_depth, Role::motion, Role::motion_back}, 7);
    ASSERT_TRUE(found.ok());
    EXPECT_EQ(found->findings.health.first_nonfinite, (std::array<int, 2>{20, 23}));
    EXPECT_GT(found->findings.clear_edges, 10u);
    EXPECT_GT(found->findings.edges.parts().depth, 0);
}

TEST_F(FrameScan, AFrameOfOneColorThatStands) {
    test::Planes planes = test::make_planes(kWidth, kHeight);
    for (float& value : planes.color.data) value = 0.5f;
    planes.motion = planes.back = ImageF(kWidth, kHeight, 2);
    test::write_frame(path(1), planes);
    test::write_frame(path(2), planes);
    expect_like_the_whole();
    planes.color.at(0, 30, 0) = 0.25f;
    test::write_frame(path(1), planes);
    expect_like_the_whole();
}

TEST_F(FrameScan, WindowsThatDiffer) {
    test::FrameFile file;
    file.display = io::Window{2, 3, 60, 55};
    test::write_frame(path(1), odd_planes(1), file);
    file.origin_x = 5;
    file.origin_y = -4;
    test::write_frame(path(2), odd_planes(2), file);
    expect_like_the_whole();
    settings_.data_window = DataWindow::keep;
    const FrameDescription there = describe(open(2));
    EXPECT_EQ(there.origin_x, 5 - 2);
    EXPECT_EQ(there.origin_y, -4 - 3);
    expect_like_the_whole();
    test::write_frame(path(1), odd_planes(1), file);
    expect_like_the_whole();
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

// Vectors as fractions of the image refer to the whole image.
TEST_F(FrameScan, VectorsInFractions) {
    test::FrameFile file;
    file.convention = "generic";
    test::write_frame(path(1), odd_planes(1), file);
    test::write_frame(path(2), odd_planes(2), file);
    auto profile = parse_profile(
        "profile: 1\nname: uv\ncolor:\n  - channels: [[R, G, B, A]]\ndepth:\n  - channels: [[Z]]\n"
        "motion:\n  - channels: [[motion.x, motion.y]]\n    unit: fraction\n"
        "    scale: [0.02, 0.03]\n",
        "uv.yaml");
    ASSERT_TRUE(profile.status().ok()) << profile.status().message();
    settings_.profile = profile.profile;
    expect_like_the_whole();
}

// A cut is told by the usual change of adjacent frames, not by changes across frames without
// pixels.
TEST(Survey, AFrameThatCannotBeReadIsNoChange) {
    SequenceSurvey survey;
    const auto add = [&](int frame, float shown) {
        Thumbnail thumbnail;
        thumbnail.add(ImageF(16, 9, 4, shown / (1 - shown)), 0, 9);
        survey.add(frame, SourceFrame(), thumbnail);
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
              "the image changes 20 times as much as usual to frame 8: a cut? (--cuts 7)");
}

TEST(Survey, NamesWhatMostFramesHaveOtherwise) {
    SequenceSurvey survey;
    Thumbnail gray;
    gray.add(ImageF(4, 3, 4, 0.5f), 0, 3);  // smaller than a thumbnail
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
    EXPECT_EQ(fault_of("damaged"), "damaged");
    EXPECT_EQ(fault_of("a.exr: chunk 3: damaged"), "chunk 3: damaged");
    // Eight of ten frames of 10 GiB each.
    const std::vector<int> ten = {0, 1, 2, 3, 4, 5, 6, 7, 8, 9};
    EXPECT_EQ(frames_to_survey(ten, uint64_t(10) << 30),
              (std::vector<int>{0, 1, 2, 3, 5, 6, 7, 9}));
    EXPECT_EQ(frames_to_survey(ten, 1), ten);
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
