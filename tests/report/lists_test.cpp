// What tables list, and in which order.
#include "tools/measure/report/lists.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tools/measure/experiment/experiment.h"
#include "tools/measure/report/words.h"

namespace postchain::report {
namespace {

TEST(Lists, VariantsByTime) {
    Report report;
    report.variants.resize(4);
    for (const auto& [index, ms] : {std::pair(0, 3.0), {1, 1.0}, {3, 1.0}}) {
        report.variants[size_t(index)].timing.emplace();
        report.variants[size_t(index)].timing->total.median_ms = ms;
    }
    const auto timed = by_time(report);
    ASSERT_EQ(timed.size(), 3u);
    EXPECT_EQ(timed[0], &report.variants[1]);  // equal times: as they stand
    EXPECT_EQ(timed[1], &report.variants[3]);
    EXPECT_EQ(timed[2], &report.variants[0]);
}

TEST(Lists, WhatWasLeftOutIsOneLinePerThingAndRule) {
    Variant variant;
    variant.left_out = {{10, {"motion_blur", "still", "0.31 px <= 0.5 px", 100, 2, 1000}},
                        {10, {"fxaa", "off", "never", 0, 1, 0}},
                        {11, {"motion_blur", "still", "0.25 px <= 0.5 px", 50, 2, 500}},
                        {12, {"motion_blur", "still", "0.31 px <= 0.5 px", 1, 1, 1}},
                        {12, {"motion_blur", "other", "0.31 px <= 0.5 px", 7, 0, 0}}};
    const auto lines = left_out_lines(variant);
    ASSERT_EQ(lines.size(), 3u);
    EXPECT_EQ(lines[0].what, "motion_blur");
    EXPECT_EQ(lines[0].rule, "still");
    EXPECT_EQ(lines[0].reason, "0.31 px <= 0.5 px");
    EXPECT_EQ(lines[0].reasons, 2);
    EXPECT_EQ(lines[0].frames, (std::vector<int>{10, 11, 12}));
    EXPECT_EQ(lines[0].bytes, 151u);
    EXPECT_EQ(lines[0].dispatches, 5);
    EXPECT_EQ(lines[0].taps, 1501u);
    EXPECT_EQ(lines[1].what, "fxaa");
    EXPECT_EQ(lines[1].reasons, 1);
    EXPECT_EQ(lines[2].rule, "other");
    EXPECT_TRUE(left_out_lines(Variant()).empty());
}

TEST(Lists, WhatAllVariantsLeftOutStandsOnce) {
    Report report;
    report.variants.resize(3);
    report.variants[0].name = "first";
    report.variants[1].name = "second";
    report.variants[2].failure = "no plan";
    const LeftOut same{"fxaa", "off", "never", 1, 1, 1};
    report.variants[0].left_out = {{1, {"dof", "still", "a", 1, 0, 0}}, {1, same}};
    report.variants[1].left_out = {{1, same}, {1, {"dof", "still", "a", 2, 0, 0}}};
    const auto rows = left_out_rows(report);
    ASSERT_EQ(rows.size(), 3u);
    EXPECT_EQ(rows[0].first, "all");
    EXPECT_EQ(rows[0].second.what, "fxaa");
    EXPECT_EQ(rows[1].first, "first");
    EXPECT_EQ(rows[1].second.bytes, 1u);
    EXPECT_EQ(rows[2].first, "second");
    EXPECT_EQ(rows[2].second.bytes, 2u);
    // One variant alone is named.
    report.variants.resize(1);
    EXPECT_EQ(left_out_rows(report)[1].first, "first");
    EXPECT_TRUE(left_out_rows(Report()).empty());
}

TEST(Lists, DoubtsAboutTimesAreOneSentence) {
    Report report;
    report.variants.resize(3);
    for (Variant& variant : report.variants) variant.timing.emplace();
    EXPECT_EQ(doubt_about_times(report), "");
    const auto doubt = [&](size_t v, const char* name) {
        report.variants[v].name = name;
        report.variants[v].timing->trustworthy = false;
        report.variants[v].timing->why_not = concat("others ran beside ", name);
    };
    doubt(2, "last");
    EXPECT_EQ(doubt_about_times(report),
              "times of last are not to be trusted: others ran beside last");
    doubt(1, "one");
    EXPECT_EQ(doubt_about_times(report),
              "times of 2 of 3 variants are not to be trusted: others ran beside one (of one)");
}

TEST(Words, FiguresAndCounts) {
    EXPECT_EQ(figure(0.370626), "0.3706");
    EXPECT_EQ(figure(0.370626, 3), "0.371");
    EXPECT_EQ(figure(12), "12");
    EXPECT_EQ(counted(1, "frame"), "1 frame");
    EXPECT_EQ(counted(0, "frame"), "0 frames");
    EXPECT_EQ(counted(2, "frame"), "2 frames");
}

TEST(Crops, SayWhyInThreeDigits) {
    const auto crops = experiment::crops_of({{{7, 0, 0, 96, 96, 0.370626}, "paper"},
                                             {{7, 96, 0, 96, 96, 0.5}, "other"},
                                             {{7, 0, 0, 96, 96, 0.2}, "other"}});
    ASSERT_EQ(crops.size(), 2u);
    EXPECT_EQ(crops[0].why, "other: mean HDR-FLIP 0.5");
    EXPECT_EQ(crops[1].why, "paper: mean HDR-FLIP 0.371");
}

}  // namespace
}  // namespace postchain::report
