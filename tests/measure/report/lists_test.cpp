// Rows of tables and their order.
#include "tools/measure/report/report.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tools/measure/experiment/experiment.h"

namespace postchain::report {
namespace {

TEST(Lists, VariantsByTime) {
    Report report;
    report.variants.resize(4);
    for (const auto& [index, ms] : {std::pair(0, 3.0), {1, 1.0}, {3, 1.0}}) {
        report.variants[size_t(index)].timing.emplace();
        report.variants[size_t(index)].timing->total.median_ms = ms;
    }
    const auto& all = report.variants;  // equal times: as they stand
    EXPECT_THAT(by_time(report), testing::ElementsAre(&all[1], &all[3], &all[0]));
}

Elision elision(int pass, const char* rule, Saving saving, double value = 0.31) {
    return {.pass = pass,
            .rule = rule,
            .fact = {.name = "largest", .value = value, .limit = 0.5, .unit = "px"},
            .saving = saving};
}

TEST(Lists, WhatWasElidedIsOneRowPerThingAndRule) {
    Report report;
    report.variants.resize(1);
    Variant& variant = report.variants[0];
    variant.name = "one";
    variant.passes = {"motion_blur", "fxaa", "motion_blur"};
    variant.elisions = {
        {10, elision(0, "still", {100, 2, 1000})},     {10, elision(1, "off", {0, 1, 0})},
        {11, elision(0, "still", {50, 2, 500}, 0.25)}, {11, elision(2, "still", {1, 0, 0})},
        {12, elision(0, "still", {1, 1, 1})},          {12, elision(0, "other", {7, 0, 0})}};
    const auto rows = elision_rows(report);
    ASSERT_EQ(rows.size(), 4u);
    EXPECT_EQ(rows[0].variant, "one");
    EXPECT_EQ(rows[0].what, "passes[0].motion_blur");
    EXPECT_EQ(rows[0].rule, "still");
    EXPECT_THAT(rows[0].reasons,
                testing::ElementsAre("largest 0.31 px <= 0.5 px", "largest 0.25 px <= 0.5 px"));
    EXPECT_EQ(rows[0].frames, (std::vector<int>{10, 11, 12}));
    EXPECT_EQ(rows[0].saving, (Saving{151, 5, 1501}));
    EXPECT_EQ(rows[1].what, "fxaa");
    EXPECT_EQ(rows[2].what, "passes[2].motion_blur");
    EXPECT_EQ(rows[3].rule, "other");
}

TEST(Lists, WhatAllVariantsElideStandsOnce) {
    Report report;
    report.variants.resize(3);
    report.variants[0].name = "first";
    report.variants[1].name = "second";
    report.variants[2].failure = "no plan";
    report.variants[2].name = "third";
    report.variants[0].passes = report.variants[1].passes = {"fxaa", "dof"};
    const Elision same = elision(0, "off", {1, 1, 1});
    report.variants[0].elisions = {{1, elision(1, "still", {1, 0, 0})}, {1, same}};
    report.variants[1].elisions = {{1, same}, {1, elision(1, "still", {2, 0, 0})}};
    const auto rows = elision_rows(report);
    ASSERT_EQ(rows.size(), 3u);
    EXPECT_EQ(rows[0].variant, "all");
    EXPECT_EQ(rows[0].what, "fxaa");
    EXPECT_EQ(rows[1].variant, "first");
    EXPECT_EQ(rows[1].saving.bytes, 1u);
    EXPECT_EQ(rows[2].variant, "second");
    EXPECT_EQ(rows[2].saving.bytes, 2u);
    // One that failed after a plan counts.
    report.variants[2].elisions = {{2, same}};
    report.variants[2].passes = {"fxaa"};
    EXPECT_EQ(elision_rows(report)[0].variant, "first");
    EXPECT_EQ(elision_rows(report).back().variant, "third");
    // One variant alone is named.
    report.variants.resize(1);
    EXPECT_EQ(elision_rows(report)[1].variant, "first");
    EXPECT_TRUE(elision_rows(Report()).empty());
}

TEST(Lists, DoubtsAboutTimesAreOneSentence) {
    Report report;
    report.variants.resize(3);
    for (Variant& variant : report.variants) variant.timing.emplace();
    EXPECT_EQ(doubt_about_times(report), "");
    for (size_t v : {2, 1}) {
        report.variants[v].name = v == 1 ? "one" : "last";
        report.variants[v].timing->trustworthy = false;
        report.variants[v].timing->why_not = "others ran beside " + report.variants[v].name;
        EXPECT_EQ(doubt_about_times(report),
                  v == 2 ? "times of last are not to be trusted: others ran beside last"
                         : "times of 2 of 3 variants are not to be trusted: others ran beside one "
                           "(of one)");
    }
}

TEST(Crops, SayWhyInThreeDigits) {
    const auto crops = experiment::crops_of({{{7, 0, 0, 96, 96, 0.370626}, "paper"},
                                             {{7, 96, 0, 96, 96, 0.5}, "other"},
                                             {{7, 0, 0, 96, 96, 0.2}, "other"}});
    ASSERT_EQ(crops.size(), 2u);
    EXPECT_EQ(crops[0].why, "other: mean HDR-FLIP 0.5");
    EXPECT_EQ(crops[1].why, "paper: mean HDR-FLIP 0.371");
    // Another frame, column or row is another crop; the worst ones are taken.
    const auto some = experiment::crops_of({{{7, 0, 0, 9, 9, 0.5}, "a"},
                                            {{8, 0, 0, 9, 9, 0.4}, "b"},
                                            {{7, 9, 0, 9, 9, 0.3}, "c"},
                                            {{7, 5, 5, 9, 9, 0.1}, "e"},
                                            {{7, 0, 9, 9, 9, 0.2}, "d"}},
                                           4);
    std::string taken;
    for (const auto& crop : some) taken += crop.why[0];
    EXPECT_EQ(taken, "abcd");
}

}  // namespace
}  // namespace postchain::report
