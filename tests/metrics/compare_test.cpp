#include "tools/metrics/compare.h"

#include "tests/metrics/support.h"
#include "tools/metrics/display.h"
#include "tools/metrics/parallel.h"

namespace postchain::metrics {
namespace {

TEST(Compare, GivesEveryMetricInTheTablesOrder) {
    auto test = gray(12, 12, 0.7);
    test.at(0, 0, 0) = std::numeric_limits<float>::quiet_NaN();
    const Pair both = pair(test, gray(12, 12, 0.5));
    const Comparison result = test::must(compare(both, {}));
    ASSERT_EQ(result.values.size(), metric_rows().size());
    for (size_t i = 0; i < metric_rows().size(); ++i)
        EXPECT_EQ(result.values[i].first, metric_rows()[i].name);
    EXPECT_EQ(*result.value("mse"), mse(both));
    EXPECT_EQ(*result.value("psnr"), *psnr(both));
    EXPECT_EQ(*result.value("flip"), flip(both, {}).mean);
    EXPECT_EQ(*result.value("nonfinite"), 1);
    EXPECT_TRUE(result.exposures.lit);
}

// Exceptions of a band in any thread reach the caller, who may continue.
TEST(ForBands, ThrowsWhatABandThrows) {
    for (const int bad : {0, 7, 15})
        EXPECT_THROW(for_bands(16, 1, 8,
                               [&](int row, int) {
                                   if (row == bad) throw std::bad_alloc();
                               }),
                     std::bad_alloc)
            << bad;
    std::atomic<int> rows = 0;
    for_bands(16, 3, 8, [&](int first, int end) { rows += end - first; });
    EXPECT_EQ(rows, 16);
}

// Dark, so that HDR-FLIP has other exposures than 0.
TEST(Compare, MapsDoNotNeedTheirMetric) {
    const Pair both = pair(gray(3, 3, 0.07), gray(3, 3, 0.05));
    const Comparison all = test::must(compare(both, {}));
    EXPECT_GT(all.exposures.start, 0);
    const std::map<std::string, double> expected = {{"flip", *all.value("flip")},
                                                    {"hdr_flip", *all.value("hdr_flip")},
                                                    {"relmse", 0.02 * 0.02 / (0.06 * 0.06)},
                                                    {"smape", 2 * 0.02 / (0.12 + 0.02)},
                                                    {"difference", 0.02}};
    ASSERT_EQ(map_rows().size(), expected.size());
    for (const auto& row : map_rows()) {
        SCOPED_TRACE(row.name);
        CompareSettings settings;
        settings.metrics = {"mse"};
        settings.map = row.name;
        const Comparison result = test::must(compare(both, settings));
        EXPECT_EQ(result.values.size(), 1u);
        ASSERT_EQ(result.map.pixels(), 9u);
        for (const float value : result.map.data) EXPECT_NEAR(value, expected.at(row.name), 1e-6);
    }
}

TEST(Compare, EachMetricByItselfIsThatOfAll) {
    auto test = gray(40, 30, 0.7);
    for (int x = 0; x < 40; ++x)
        for (int y = 0; y < 30; ++y) test.at(x, y, x % 3) += float(x * y) / 1000;
    const Pair both = pair(test, gray(40, 30, 0.5));
    Values each;
    for (const MetricRow& row : metric_rows()) {
        CompareSettings settings;
        settings.metrics = {row.name};
        const Comparison result = test::must(compare(both, settings));
        ASSERT_EQ(result.values.size(), 1u) << row.name;
        each.push_back(result.values[0]);
    }
    EXPECT_EQ(each, test::must(compare(both, {})).values);
}

TEST(Compare, UsesTheGivenExposures) {
    const Pair both = pair(gray(3, 3, 0.7), gray(3, 3, 0.5));
    CompareSettings settings;
    settings.metrics = {"hdr_flip"};
    settings.exposures = ExposureRange{-30, -28, true};  // all black
    settings.map = "hdr_flip";
    const Comparison black = test::must(compare(both, settings));
    EXPECT_LT(*black.value("hdr_flip"), 1e-3);
    EXPECT_LT(black.map.at(1, 1), 1e-3);
    settings.exposures.reset();
    EXPECT_EQ(*compare(both, settings)->value("hdr_flip"),
              hdr_flip(both, exposure_range(both.reference, ToneMapper::aces), {}).mean);
}

TEST(Compare, RefusesUnknownNames) {
    const Pair both = pair(gray(3, 3, 0.7), gray(3, 3, 0.5));
    CompareSettings settings;
    settings.metrics = {"vmaf"};
    EXPECT_EQ(compare(both, settings).status().code(), StatusCode::usage);
    settings = {};
    settings.map = "psnr";
    EXPECT_EQ(compare(both, settings).status().code(), StatusCode::usage);
}

TEST(Compare, ValuesThatDoNotExistAreSaidNotToExist) {
    const Comparison result = test::must(compare(pair(gray(1, 1, 0.5), gray(1, 1, 0.5)), {}));
    for (const auto& [name, value] : result.values)
        EXPECT_EQ(value.has_value(), name != "psnr" && name != "ssim") << name;
}

TEST(Compare, ASequenceHasMeansButTheSumOfPixelsAndTheLargestDifference) {
    const std::vector<Values> frames = {
        {{"mse", 1}, {"psnr", {}}, {"ssim", {}}, {"nonfinite", 2}, {"difference_max", 5}},
        {{"mse", 4}, {"psnr", 30}, {"ssim", {}}, {"nonfinite", 3}, {"difference_max", 4}}};
    EXPECT_EQ(
        summary_of(frames),
        (Values{
            {"mse", 2.5}, {"psnr", 30}, {"ssim", {}}, {"nonfinite", 5}, {"difference_max", 5}}));
}

TEST(Limit, PixelsWithoutAValueBreakEveryLimitButTheirOwn) {
    for (const double pixels : {0.0, 1.0}) {
        EXPECT_EQ(nonfinite_fault({{"mse", 1}}, pixels).empty(), pixels == 0);
        EXPECT_EQ(nonfinite_fault({}, pixels), "");
        EXPECT_EQ(nonfinite_fault({{"mse", 1}, {"nonfinite", 0}}, pixels), "");
    }
}

TEST(Limit, IsAMetricAndAFiniteNumber) {
    const auto limit = parse_limit("under", "flip=-1e-3");
    ASSERT_TRUE(limit.ok());
    EXPECT_EQ(limit->metric, "flip");
    EXPECT_EQ(limit->value, -1e-3);
    for (const char* text : {"flip", "flip=", "flip=x", "flip=1 ", "flip=inf", "flip=nan"})
        EXPECT_EQ(parse_limit("under", text).status().code(), StatusCode::usage) << text;
}

}  // namespace
}  // namespace postchain::metrics
