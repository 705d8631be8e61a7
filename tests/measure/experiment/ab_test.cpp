// run_ab on small sequences.
#include "tools/measure/experiment/run_experiment.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>

#include "tests/measure/experiment/support.h"
#include "tests/support/images.h"
#include "tests/support/status.h"
#include "tools/measure/report/images.h"

namespace postchain::experiment {

using namespace report;
namespace {

using ::testing::HasSubstr;

// A chain without passes returns its input; the ground truth is the input + 1/8.
constexpr const char* kNothing = "postchain: 1\npasses: []\n";

void write_frames(const std::string& folder) {
    test::write_sequence(folder, 3);
    test::write_truth(folder, 1, 3, 0.125f);
}

Report report_of(Chain a, Chain b, const ExperimentSettings& settings) {
    return test::must(run_ab({"one", std::move(a)}, {"two", std::move(b)}, settings,
                             test::executor(), {}, nullptr));
}
Report report_of(const char* a, const char* b, const ExperimentSettings& settings) {
    return report_of(test::parse(a), test::parse(b), settings);
}

class Ab : public ::testing::Test {
  protected:
    void SetUp() override { write_frames(folder_.path()); }
    ExperimentSettings settings() {
        return test::settings_for(folder_.path(), folder_.path("report"));
    }
    test::TempFolder folder_;
};

// kChainText against kNothing, run once for the tests that only look at its report.
const Report& against_nothing() {
    static const test::TempFolder folder;
    static const Report report = [] {
        write_frames(folder.path());
        return report_of(test::kChainText, kNothing,
                         test::settings_for(folder.path(), folder.path("report")));
    }();
    return report;
}

TEST(AbAgainstNothing, ValuesAreKnown) {
    const Report& report = against_nothing();
    EXPECT_EQ(report.frames, (std::vector<int>{1, 2, 3}));
    const auto& values = report.variants[1].metrics;
    for (size_t i = 0; i < 3; ++i) {
        EXPECT_NEAR(*values.at("mse").frames[i], 1.0 / 64, 1e-7);
        EXPECT_NEAR(*values.at("difference_max").frames[i], 0.125, 1e-6);
        EXPECT_EQ(*values.at("nonfinite").frames[i], 0);
    }
    // The error is constant: only rounding is left in tde. The first frame has no difference over
    // time.
    EXPECT_FALSE(values.at("tde").frames[0] || values.at("temporal_error").frames[0]);
    EXPECT_LT(*values.at("tde").frames[1], 1e-6);
    // The pixels move or are outlines. A ratio of sums lies between those of the parts.
    const double moving = *values.at("temporal_error_moving").frames[1];
    const double outline = *values.at("temporal_error_outline").frames[1];
    EXPECT_NE(moving, outline);
    EXPECT_GT(*values.at("temporal_error").frames[1], std::min(moving, outline));
    EXPECT_LT(*values.at("temporal_error").frames[1], std::max(moving, outline));
    for (const char* none : {"temporal_error_still", "temporal_error_defocused"})
        EXPECT_FALSE(values.at(none).mean) << none;
    EXPECT_EQ(report.comparison->metrics[0].n, 3);
}

// The unfiltered input scores as a chain without passes, in every metric that both have.
TEST(AbAgainstNothing, TheInputIsScoredToo) {
    const Report& report = against_nothing();
    const Metrics& nothing = report.variants[1].metrics;
    EXPECT_GE(test::expect_same_values(report.input_metrics, nothing), 40u);
    EXPECT_FALSE(report.input_metrics.contains("flicker"));
    EXPECT_THAT(report.warnings,
                ::testing::Contains(::testing::AllOf(HasSubstr("no better than doing nothing"),
                                                     HasSubstr("two "))));
    EXPECT_GT(*report.truth_noise.at(kNoiseSigma).mean, 0);
}

// A chain without random numbers has no flicker, one without tiles no grid; noise has no grid.
TEST(AbAgainstNothing, FlickerGridAndTimesAreMeasured) {
    const std::vector<Variant>& variants = against_nothing().variants;
    for (const char* metric : {"flicker", "grid"}) {
        const Series& series = variants[0].metrics.at(metric);
        for (size_t i = 0; i < 3; ++i) {
            ASSERT_TRUE(series.frames[i]) << metric << i;
            EXPECT_GT(*series.frames[i], 1e-4) << metric << i;
        }
        EXPECT_NE(*series.frames[0], *series.frames[1]) << metric;
        EXPECT_FALSE(variants[1].metrics.at(metric).mean) << metric;
    }
    const Timing& timing = *variants[0].timing;
    ASSERT_EQ(timing.passes.size(), 2u);
    EXPECT_EQ(timing.passes[0].pass, "0.motion_blur");
    EXPECT_EQ(timing.passes[0].time.n, 2);
    EXPECT_GT(timing.total.median_ms, 0);
    EXPECT_FALSE(timing.source.empty());
    EXPECT_EQ(variants[1].timing->total.median_ms, 0);
}

TEST(AbAgainstNothing, StoredMapsAreThoseOfTheMetrics) {
    const Report& report = against_nothing();
    for (const int variant : {-1, 1}) {
        const Metrics& metrics = variant < 0 ? report.input_metrics : report.variants[1].metrics;
        for (const char* name : {"flip", "hdr_flip"}) {
            const StoredImage* stored = report.find(ImageKind::error, variant, 2, name);
            ASSERT_TRUE(stored) << name;
            const ImageF map = test::must(load_image(report, *stored));
            double sum = 0;
            for (const float v : map.data) sum += double(v);
            EXPECT_NEAR(sum / double(map.pixels()), *metrics.at(name).frames[1], 1e-6) << name;
        }
        EXPECT_NE(*metrics.at("flip").mean, *metrics.at("hdr_flip").mean);
    }
}

TEST_F(Ab, ImagesAreThoseOfTheChainsAlone) {
    const char* const texts[] = {test::kChainText, test::kOtherOrderText};
    const Report report = report_of(texts[0], texts[1], settings());
    auto made = test::layered_frame(64, 40, {6, 2}, {-3, 1}, 2);
    made.description.frame_number = 2;
    for (int v = 0; v < 2; ++v) {
        const StoredImage* stored = report.find(ImageKind::color, v, 2);
        ASSERT_TRUE(stored);
        const ImageF pixels = test::must(load_image(report, *stored));
        const ImageF alone =
            test::filter(test::parse(texts[v]), made.description, made.planes).at(Role::color);
        const ImageF rgb =
            test::make_image(64, 40, 3, [&](int x, int y, int c) { return alone.at(x, y, c); });
        EXPECT_LT(test::compare(pixels, rgb, 0).max, 1e-4);
    }
    // Input, ground truth, two results, and two maps of each result and of the input, for three
    // frames. A slice of the ground truth and of each result.
    EXPECT_EQ(report.images.size(), 30u + 3u);
    EXPECT_FALSE(report.crops.empty());
    for (const Crop& crop : report.crops) {
        EXPECT_LE(crop.x + crop.width, 64);
        EXPECT_LE(crop.y + crop.height, 40);
    }
}

// Frames without a ground truth are filtered but not measured: the other frames have the same
// values as with one for all.
TEST_F(Ab, ATruthForAPartOfTheFrames) {
    std::filesystem::remove(folder_.path("truth.0002.exr"));
    const Report report = report_of(test::kChainText, kNothing, settings());
    EXPECT_EQ(report.frames, (std::vector<int>{1, 2, 3}));
    EXPECT_EQ(report.scored_frames, (std::vector<int>{1, 3}));
    EXPECT_EQ(report.page_frames, (std::vector<int>{1, 3}));
    EXPECT_THAT(report.notes, ::testing::Contains(HasSubstr(
                                  "2 of 3 frames were measured, those with a ground truth: 1, 3")));
    for (size_t v : {0, 1}) {
        const Metrics& metrics = report.variants[v].metrics;
        const Series& whole = against_nothing().variants[v].metrics.at("mse");
        EXPECT_EQ(metrics.at("mse").frames[0], whole.frames[0]);
        EXPECT_FALSE(metrics.at("mse").frames[1]);
        EXPECT_TRUE(metrics.at("mse").frames[2]);
        EXPECT_FALSE(metrics.at("tde").frames[2]);  // no difference to frame 2
        EXPECT_TRUE(report.variants[v].timing);
        EXPECT_EQ(report.variants[v].failure, "");
    }
    EXPECT_TRUE(report.variants[0].metrics.at("grid").frames[1]);  // it was filtered
    EXPECT_EQ(report.comparison->metrics[0].n, 2);
    EXPECT_FALSE(report.input_metrics.at("mse").frames[1]);
    EXPECT_TRUE(report.input_metrics.at("mse").frames[2]);
}

// Also of frames that were not requested.
TEST_F(Ab, AChainGetsThePlanesOfTheFramesBeforeAndAfter) {
    auto two = settings();
    two.run.frames = io::FrameRange{{2, 3}};
    const Report report =
        report_of(test::chain_of("echo"),
                  test::chain_of("echo", {{"neighbors", std::string("before")}}), two);
    const StoredImage* stored = report.find(ImageKind::color, 0, 2);
    ASSERT_TRUE(stored);
    const ImageF pixels = test::must(load_image(report, *stored));
    const auto color = [](uint32_t frame, int x) {
        return test::layered_frame(64, 40, {6, 2}, {-3, 1}, frame)
            .planes.at(Role::color)
            .at(x, 11, 1);
    };
    for (const int x : {0, 21, 40, 63})
        EXPECT_NEAR(pixels.at(x, 11, 1),
                    1.5f * color(2, x) - 0.25f * color(1, x) - 0.25f * color(3, x), 2e-3);
    EXPECT_THAT(report.notes,
                ::testing::Contains("frame 3 is filtered without the frame after: frame 3 is the "
                                    "last on disk"));
}

TEST_F(Ab, AChainThatFailsLeavesTheOther) {
    // Depth of field without a lens: no frame can be planned.
    const Report report =
        report_of(test::kChainText, "postchain: 1\npasses: [depth_of_field]\n", settings());
    EXPECT_THAT(report.variants[1].failure,
                ::testing::AllOf(HasSubstr("frame 1: "), HasSubstr("focal_length_mm")));
    EXPECT_TRUE(report.variants[0].failure.empty());
    EXPECT_TRUE(report.variants[0].metrics.at("mse").mean);
    EXPECT_FALSE(report.variants[1].timing);
    EXPECT_THAT(report.comparison->verdict, HasSubstr("two failed"));
}

TEST_F(Ab, ProgressIsToldAndAStopEndsIt) {
    std::atomic<bool> stop = false;
    size_t last = 0;
    const auto run = [&] {
        const NamedChain chain{"one", test::parse(kNothing)};
        return run_ab(
            chain, chain, settings(), test::executor(),
            [&](const ExperimentProgress& progress) {
                EXPECT_EQ(progress.total, 8u);  // three frames and a timing, of two
                EXPECT_GE(progress.done, last);
                last = progress.done;
            },
            &stop);
    };
    stop = true;
    EXPECT_EQ(run().status().code(), StatusCode::canceled);
    stop = false;
    EXPECT_EQ(test::error_of(run()), "");
    EXPECT_EQ(last, 8u);
}

TEST_F(Ab, WithoutATruthTheSecondIsHeldAgainstTheFirst) {
    auto blind = settings();
    blind.truth.clear();
    const Report report = report_of(kNothing, test::kChainText, blind);
    EXPECT_EQ(report.reference, "a");
    EXPECT_EQ(report.no_truth, "no ground truth given (-r)");
    EXPECT_FALSE(report.variants[0].metrics.count("mse"));
    EXPECT_GT(*report.variants[1].metrics.at("mse").mean, 0);
    EXPECT_FALSE(report.truth || report.find(ImageKind::truth, -1, 1) || report.winner);
    EXPECT_TRUE(report.input_metrics.empty() && report.truth_noise.empty());
    EXPECT_THAT(report.comparison->verdict, HasSubstr("Without a ground truth"));
}

}  // namespace
}  // namespace postchain::experiment
