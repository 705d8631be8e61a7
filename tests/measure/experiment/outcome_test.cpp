// Verdicts on differences, winners and warnings, on fabricated values.
#include "tools/measure/experiment/outcome.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/text_file.h"
#include "tools/measure/experiment/experiment.h"
#include "tools/measure/experiment/statistics.h"

namespace postchain::experiment {

using namespace report;
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

using Values = std::vector<std::optional<double>>;

void fill(Metrics& metrics, const std::string& name, const Values& values) {
    for (size_t i = 0; i < values.size(); ++i)
        set_value(metrics, name, i, values.size(), values[i]);
    find_means(metrics);
}

// HDR-FLIP per frame of each variant (v0, v1, ...) and of the input.
Report fabricate(Kind kind, const std::vector<Values>& variants, const Values& input) {
    Report report;
    report.kind = kind;
    report.reference = "truth";
    report.metrics = {{"hdr_flip", "", Better::lower},
                      {"mse", "", Better::lower},
                      {"sharpness_in_focus", "", Better::one}};
    for (size_t i = 0; i < variants[0].size(); ++i) report.frames.push_back(int(i) + 1);
    for (const Values& values : variants) {
        report.variants.emplace_back();
        report.variants.back().name = concat("v", report.variants.size() - 1);
        fill(report.variants.back().metrics, "hdr_flip", values);
    }
    if (!input.empty()) fill(report.input_metrics, "hdr_flip", input);
    if (kind == Kind::ab) report.comparison = compare_variants(report, {});
    return report;
}

Report stated(Report report) {
    state_outcome(report);
    return report;
}

const Values kLow = {.10, .11, .12, .10, .11, .12, .10, .11};
const Values kHigh = {.20, .22, .21, .20, .22, .21, .20, .22};
// Alternately above and below kLow: equal in the mean.
const Values kAround = {.11, .10, .13, .09, .12, .11, .11, .10};

TEST(Outcome, AbIsWonByTheOneThatItsIntervalSays) {
    const Report report = stated(fabricate(Kind::ab, {kHigh, kLow}, {}));
    ASSERT_TRUE(report.winner);
    EXPECT_EQ(report.winner->variant, 1u);
    EXPECT_EQ(report.winner->metric, "hdr_flip");
    EXPECT_THAT(report.winner->words, HasSubstr("v1 is closer to the ground truth by HDR-FLIP"));
    EXPECT_EQ(stated(fabricate(Kind::ab, {kLow, kHigh}, {})).winner->variant, 0u);
}

TEST(Outcome, AbWithoutADecisionHasNoWinner) {
    EXPECT_FALSE(stated(fabricate(Kind::ab, {kLow, kAround}, {})).winner);
    EXPECT_FALSE(stated(fabricate(Kind::ab, {{.2, .2}, {.1, .1}}, {})).winner);
    Report blind = fabricate(Kind::ab, {kHigh, kLow}, {});
    blind.reference = "a";
    EXPECT_FALSE(stated(blind).winner);
}

TEST(Outcome, BenchIsWonByTheLowestMeanOfThoseThatDidNotFail) {
    Report report = fabricate(Kind::bench, {{.3}, {.1}, {.2}, {.05}}, {});
    report.variants[3].failure = "frame 2: out of memory";
    report = stated(report);
    ASSERT_TRUE(report.winner);
    EXPECT_EQ(report.winner->variant, 1u);
    EXPECT_EQ(report.winner->words,
              "v1 has the lowest mean HDR-FLIP of 3 variants: 0.1; the next is v2 with 0.2");
    EXPECT_FALSE(stated(fabricate(Kind::bench, {{.1}}, {})).winner);
    // One that comes later is neither the best nor the next.
    EXPECT_THAT(
        stated(fabricate(Kind::bench, {{.1}, {.2}, {std::nullopt}, {.3}}, {})).winner->words,
        HasSubstr("of 3 variants: 0.1; the next is v1 with 0.2"));
}

TEST(Outcome, AVariantWorseThanTheInputIsNamed) {
    const auto warnings = [](const std::vector<Values>& variants, const Values& input) {
        return stated(fabricate(Kind::bench, variants, input)).warnings;
    };
    EXPECT_THAT(warnings({{.3, .3}, {.1, .1}}, {.2, .2}),
                ElementsAre("1 of 2 variants is no better than doing nothing, by mean HDR-FLIP "
                            "(lower is better): v0 0.3, the input 0.2"));
    EXPECT_THAT(warnings({{.1, .1}, {.15, .1}}, {.2, .2}), IsEmpty());
    EXPECT_THAT(warnings({{.2, .2}, {.1, .1}}, {.2, .2}),
                ElementsAre(HasSubstr("1 of 2 variants is no better")));
    // Over frames that both have: the variant failed on the frame where the input is bad.
    EXPECT_THAT(warnings({{.3, std::nullopt}, {.1, .1}}, {.2, .9}),
                ElementsAre(HasSubstr("v0 0.3, the input 0.2")));
    EXPECT_THAT(warnings({{.1, .3}, {.1, .1}}, {std::nullopt, .2}),
                ElementsAre(HasSubstr("v0 0.3, the input 0.2")));
    EXPECT_THAT(warnings({{.3, std::nullopt}}, {std::nullopt, .2}), IsEmpty());
    // Many are counted, not listed.
    EXPECT_THAT(warnings(std::vector<Values>(9, Values{.3}), {.2}),
                ElementsAre(AllOf(HasSubstr("9 of 9 variants are no better"), HasSubstr("v4 0.3"),
                                  Not(HasSubstr("v5")), HasSubstr("; and 4 more"))));
}

TEST(Outcome, FromEightFramesOnTheIntervalDecides) {
    EXPECT_THAT(stated(fabricate(Kind::bench, {kAround, kHigh}, kLow)).warnings,
                ElementsAre(AllOf(HasSubstr("1 of 2 variants is no better than doing nothing"),
                                  HasSubstr("v1 0.21, the input 0.108")),
                            AllOf(HasSubstr("is not measurably better than doing nothing"),
                                  HasSubstr(" (t-interval of the difference -0.008"))));
    EXPECT_THAT(stated(fabricate(Kind::bench, {kLow}, kHigh)).warnings, IsEmpty());
}

// From a share of 0.2 to 0.06: 0.2/0.8 over 0.06/0.94 is a factor of 3.92.
TEST(Outcome, ANoisyTruthIsDoubtedWithNumberAndRemedy) {
    const auto warnings = [](double sharpness) {
        Report report = fabricate(Kind::bench, {{.1}, {.15}}, {.2});
        fill(report.truth_noise, kNoiseSigma, {.0123});
        fill(report.truth_noise, "sharpness_in_focus", {sharpness});
        return stated(report).warnings;
    };
    EXPECT_THAT(
        warnings(.8),
        ElementsAre("sharpness_in_focus is unreliable: the ground truth is noisy (standard "
                    "deviation 0.012 of the displayed luma), and an image without any "
                    "error would have 0.8 instead of 1; give the ground truth about 4 times the "
                    "samples per pixel"));
    EXPECT_THAT(warnings(.945), IsEmpty());
    EXPECT_THAT(warnings(.06), ElementsAre(HasSubstr("about 246 times the samples")));
    EXPECT_THAT(warnings(.04), ElementsAre(HasSubstr("truth many more samples per pixel")));
}

TEST(Outcome, MseThatIsMostlyNoiseIsDoubted) {
    Report report = fabricate(Kind::bench, {{.1}, {.15}}, {.2});
    fill(report.variants[0].metrics, "mse", {.02});
    fill(report.variants[1].metrics, "mse", {.01});
    fill(report.truth_noise, kNoiseSigma, {.05});
    state_outcome(report);
    EXPECT_THAT(report.warnings, IsEmpty());
    fill(report.truth_noise, "mse", {.004});
    state_outcome(report);
    EXPECT_THAT(report.warnings, IsEmpty());
    fill(report.truth_noise, "mse", {.006});
    state_outcome(report);
    EXPECT_THAT(report.warnings, ElementsAre(HasSubstr("makes 0.006 of the 0.01 of v1")));
    std::swap(report.variants[0].metrics, report.variants[1].metrics);
    report.warnings.clear();
    state_outcome(report);
    EXPECT_THAT(report.warnings, ElementsAre(HasSubstr("makes 0.006 of the 0.01 of v0")));
}

// Values of one metric per frame of two variants.
Report fabricate(const std::string& metric, Better better, const Values& first,
                 const Values& second) {
    Report report;
    report.reference = "truth";
    report.metrics = {{metric, "", better}};
    for (size_t i = 0; i < first.size(); ++i) report.frames.push_back(int(i) + 1);
    report.variants.resize(2);
    report.variants[0].name = "first";
    report.variants[1].name = "second";
    fill(report.variants[0].metrics, metric, first);
    fill(report.variants[1].metrics, metric, second);
    return report;
}

const Values kBase = {0.10, 0.12, 0.11, 0.13, 0.10, 0.12, 0.11, 0.13};

Values shifted(const Values& values, Values by) {
    for (size_t i = 0; i < by.size(); ++i) *by[i] += *values[i];
    return by;
}

const Values kConstantGain = {-.010, -.012, -.011, -.009, -.010, -.011, -.012, -.009};
const Values kScatter = {-.010, .012, -.011, .009, .010, -.011, .012, -.009};

Comparison compared(const std::string& metric, Better better, const Values& a, const Values& b) {
    return compare_variants(fabricate(metric, better, a, b), {});
}

// A transcript: a line for each metric, the claims, the verdict.
class Told {
  public:
    void add(const std::string& name, const Comparison& comparison) {
        text_ += "# " + name + "\n";
        for (const auto& metric : comparison.metrics)
            text_ += concat(metric.metric, ", ", name_of(metric.finding), ": ", metric.words, "\n");
        text_ += comparison.claims + "\n" + comparison.verdict + "\n\n";
    }
    const std::string& text() const { return text_; }

  private:
    std::string text_;
};

// Sums of the differences of two tiles of 10 pixels.
TileBootstrap two_tiles(double first, double second) {
    TileBootstrap bootstrap(1, 100);
    bootstrap.add(1, {{first, second}, {10, 10}});
    return bootstrap;
}

TEST(Verdict, Sentences) {
    Told told;
    const Values gain = shifted(kBase, kConstantGain), one = {0.1}, a = {0.2, 0.22},
                 b = {0.1, 0.13};
    const auto seven = [](const Values& values) {
        return Values(values.begin(), values.begin() + 7);
    };
    struct Row {
        const char* name;
        Better better;
        Values a, b;
    };
    const Row rows[] = {{"seven frames", Better::lower, seven(kBase), seven(gain)},
                        {"one frame", Better::lower, one, {0.15}},
                        {"gain", Better::lower, kBase, gain},
                        {"loss", Better::lower, gain, kBase},
                        {"more is better", Better::higher, kBase, gain},
                        {"less is worse", Better::higher, gain, kBase},
                        {"scatter", Better::lower, kBase, shifted(kBase, kScatter)},
                        {"equal", Better::lower, kBase, kBase},
                        {"equal in one frame", Better::lower, one, one}};
    for (const Row& row : rows) told.add(row.name, compared("hdr_flip", row.better, row.a, row.b));

    for (const auto& [from, to] : {std::pair(0.7, 1.2), {1.2, 0.7}}) {
        auto ratios = fabricate("edges_in_blurred", Better::one, Values(8, from), Values(8, to));
        fill(ratios.input_metrics, "edges_in_blurred", {1.4});
        ratios.metrics.push_back({"sharpness_in_focus", "", Better::one});
        fill(ratios.variants[0].metrics, "sharpness_in_focus", {0.8});
        fill(ratios.variants[1].metrics, "sharpness_in_focus", {0.9});
        told.add(concat("ratios ", from, " and ", to), compare_variants(ratios, {}));
    }

    auto partly = fabricate("hdr_flip", Better::lower, kBase, gain);
    partly.variants[1].metrics["hdr_flip"].frames[3].reset();
    partly.variants[1].failure = "frame 4: out of memory";
    told.add("a frame that one lacks", compare_variants(partly, {}));

    const auto with_tiles = [&](const Values& x, const Values& y, const TileBootstrap& tiles) {
        return compare_variants(fabricate("hdr_flip", Better::lower, x, y), {{"hdr_flip", tiles}});
    };
    told.add("tiles for b", with_tiles(a, b, two_tiles(-1, -0.5)));
    told.add("tiles for a", with_tiles(b, a, two_tiles(1, 0.5)));
    told.add("tiles for none", with_tiles(b, a, two_tiles(1, -1)));
    told.add("tiles of many frames", with_tiles(kBase, gain, two_tiles(-1, -0.5)));

    auto blind = fabricate("hdr_flip", Better::lower, {0, 0}, {0.1, 0.2});
    blind.reference = "a";
    blind.variants[0].metrics.clear();
    told.add("without a truth", compare_variants(blind, {}));
    fill(blind.variants[1].metrics, "mse", {0, 0});
    told.add("without a truth, equal", compare_variants(blind, {}));
    test::expect_text_of(POSTCHAIN_SOURCE_DIR "/tests/measure/experiment/expected.verdicts",
                         told.text());
}

TEST(Verdict, WithoutAFrameOfBothThereIsNone) {
    for (const char* reference : {"truth", "a"}) {
        auto report = fabricate("hdr_flip", Better::lower, {0.1, std::nullopt}, {std::nullopt, {}});
        report.reference = reference;
        report.variants[1].failure = "frame 1: no camera";
        const Comparison none = compare_variants(report, {});
        EXPECT_EQ(none.verdict,
                  "No frame was filtered by both chains. second failed: frame 1: no camera.");
        for (const auto& metric : none.metrics)
            EXPECT_EQ(metric.words, "no frame has a value for both");
    }
}

TEST(Verdict, OtherMetricsAreNamedOrIfManyCounted) {
    const Values gain = shifted(kBase, kConstantGain);
    for (const bool second : {false, true}) {
        auto report = fabricate("hdr_flip", Better::lower, kBase, gain);
        std::string names;
        for (const char* name : {"mse", "smape", "tde", "grid"}) {
            report.metrics.push_back({name, "", Better::lower});
            fill(report.variants[0].metrics, name, second ? kBase : gain);
            fill(report.variants[1].metrics, name, second ? gain : kBase);
            names += (names.empty() ? "" : ", ") + std::string(name);
            const bool many = report.metrics.size() > 4;
            EXPECT_THAT(
                compare_variants(report, {}).verdict,
                testing::EndsWith(concat(" frames). ", second ? "second" : "first",
                                         " is better by ", many ? "4 other metrics" : names, ".")));
        }
    }
}

TEST(Frames, AreSpreadEvenlyWithBothEnds) {
    const std::vector<int> ten = {10, 11, 12, 13, 14, 15, 16, 17, 18, 19};
    const std::pair<int, std::vector<int>> rows[] = {
        {-1, {}}, {0, {}}, {1, {10}}, {2, {10, 19}}, {3, {10, 14, 19}}, {10, ten}, {99, ten}};
    for (const auto& [count, chosen] : rows) EXPECT_EQ(spread_frames(ten, count), chosen) << count;
    EXPECT_THAT(spread_frames({}, 3), IsEmpty());
}

// Tiles of 2 in 5 x 3 pixels; at the border a tile is smaller and its mean counts.
TEST(WorstTile, HasTheLargestMean) {
    ImageF map(5, 3, 1);
    const auto worst = [&] {
        const WorstTile tile = worst_tile(map, 7, 2);
        EXPECT_EQ(tile.frame, 7);
        return std::tuple(tile.x, tile.y, tile.width, tile.height, tile.value);
    };
    map.at(3, 1) = 4;
    EXPECT_EQ(worst(), std::tuple(2, 0, 2, 2, 1));
    map.at(0, 2) = 3;
    EXPECT_EQ(worst(), std::tuple(0, 2, 2, 1, 1.5));
    map.at(4, 0) = 4;
    EXPECT_EQ(worst(), std::tuple(4, 0, 1, 2, 2));
}

}  // namespace
}  // namespace postchain::experiment
