// run_ab on small sequences.
#include "tools/measure/experiment/ab.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <chrono>

#include "tests/experiment/support.h"
#include "tests/support/images.h"
#include "tools/measure/report/images.h"

namespace postchain::experiment {

using namespace report;
namespace {

using ::testing::HasSubstr;

class Ab : public ::testing::Test {
  protected:
    void SetUp() override {
        test::write_sequence(folder_.path(), 1, 3);
        test::write_truth(folder_.path(), "truth", 1, 3, 0.125f);
    }
    NamedChain chain(const char* name, const char* text) { return {name, test::parse(text)}; }
    ExperimentSettings settings() {
        return test::settings_for(folder_.path(), folder_.path("report"));
    }
    Result<Report> run(const char* a, const char* b, const ExperimentSettings& settings) {
        return run_ab(chain("one", a), chain("two", b), settings, test::executor(), {}, nullptr);
    }
    test::TempFolder folder_;
};

// A chain without passes returns its input; the ground truth is the input + 1/8.
constexpr const char* kNothing = "postchain: 1\npasses: []\n";

TEST_F(Ab, ValuesOfAChainThatDoesNothingAreKnown) {
    auto report = run(test::kChainText, kNothing, settings());
    ASSERT_TRUE(report.ok()) << report.status().message();
    EXPECT_EQ(report->frames, (std::vector<int>{1, 2, 3}));
    const auto& values = report->variants[1].metrics;
    for (size_t i = 0; i < 3; ++i) {
        EXPECT_NEAR(*values.at("mse").frames[i], 1.0 / 64, 1e-7);
        EXPECT_NEAR(*values.at("difference_max").frames[i], 0.125, 1e-6);
        EXPECT_EQ(*values.at("nonfinite").frames[i], 0);
    }
    EXPECT_NEAR(*values.at("mse").mean, 1.0 / 64, 1e-7);
    // The error is constant: only rounding is left in tde. The first frame has no difference over
    // time.
    EXPECT_FALSE(values.at("tde").frames[0]);
    EXPECT_LT(*values.at("tde").frames[1], 1e-6);
    EXPECT_TRUE(report->comparison);
    EXPECT_EQ(report->comparison->metrics[0].n, 3);
}

// The unfiltered input scores as a chain without passes, in every metric that both have.
TEST_F(Ab, TheInputIsScoredToo) {
    auto report = run(test::kChainText, kNothing, settings());
    ASSERT_TRUE(report.ok()) << report.status().message();
    const Metrics& nothing = report->variants[1].metrics;
    size_t compared = 0;
    for (const auto& [name, series] : report->input_metrics) {
        for (size_t i = 0; i < 3; ++i) {
            ASSERT_EQ(series.frames[i].has_value(), nothing.at(name).frames[i].has_value()) << name;
            if (!series.frames[i]) continue;
            EXPECT_NEAR(*series.frames[i], *nothing.at(name).frames[i], 1e-6) << name << i;
            ++compared;
        }
    }
    EXPECT_GE(compared, 40u);
    EXPECT_NEAR(*report->input_metrics.at("mse").mean, 1.0 / 64, 1e-7);
    EXPECT_TRUE(report->input_metrics.at("tde").frames[1]);
    EXPECT_FALSE(report->input_metrics.contains("flicker"));
    EXPECT_TRUE(report->find(ImageKind::error, -1, 3, "hdr_flip"));
    // A chain without effect is no better than the input, and the report says so.
    EXPECT_THAT(report->warnings,
                ::testing::Contains(HasSubstr("no better than doing nothing, by mean HDR-FLIP")));
    EXPECT_THAT(report->warnings, ::testing::Contains(HasSubstr("two ")));
    EXPECT_GT(*report->truth_noise.at(kNoiseSigma).mean, 0);
}

TEST_F(Ab, PicturesAreThoseOfTheChainsAlone) {
    auto report = run(test::kChainText, test::kOtherOrderText, settings());
    ASSERT_TRUE(report.ok()) << report.status().message();
    EXPECT_GE(report->comparison->shared_steps, 2);
    const auto made = test::layered_frame(64, 40, {6, 2}, {-3, 1}, 2);
    const char* const texts[] = {test::kChainText, test::kOtherOrderText};
    for (int v = 0; v < 2; ++v) {
        const StoredImage* stored = report->find(ImageKind::color, v, 2);
        ASSERT_TRUE(stored);
        auto pixels = load_image(*report, *stored);
        ASSERT_TRUE(pixels.ok()) << pixels.status().message();
        FrameDescription description = made.description;
        description.frame_number = 2;
        const auto alone = test::filter(test::parse(texts[v]), description, made.planes);
        EXPECT_LT(test::compare(
                      *pixels,
                      [&] {
                          ImageF rgb(64, 40, 3);
                          for (int y = 0; y < 40; ++y)
                              for (int x = 0; x < 64; ++x)
                                  for (int c = 0; c < 3; ++c)
                                      rgb.at(x, y, c) = alone.at(Role::color).at(x, y, c);
                          return rgb;
                      }(),
                      0)
                      .max,
                  1e-4);
    }
    // Input, ground truth, two results, and two maps of each result and of the input, for three
    // frames.
    EXPECT_EQ(report->images.size(), 30u);
    EXPECT_TRUE(report->find(ImageKind::error, 1, 3, "hdr_flip"));
    EXPECT_FALSE(report->crops.empty());
    for (const Crop& crop : report->crops) {
        EXPECT_LE(crop.x + crop.width, 64);
        EXPECT_LE(crop.y + crop.height, 40);
    }
}

// Frames without a ground truth are filtered but not measured: the other frames have the same
// values as without them.
TEST_F(Ab, ATruthForAPartOfTheFrames) {
    auto whole = run(test::kChainText, kNothing, settings());
    ASSERT_TRUE(whole.ok()) << whole.status().message();
    EXPECT_EQ(whole->scored_frames, whole->frames);
    std::filesystem::remove(folder_.path("truth.0002.exr"));
    ExperimentSettings part = settings();
    part.folder = folder_.path("part");
    auto report = run(test::kChainText, kNothing, part);
    ASSERT_TRUE(report.ok()) << report.status().message();
    EXPECT_EQ(report->frames, (std::vector<int>{1, 2, 3}));
    EXPECT_EQ(report->scored_frames, (std::vector<int>{1, 3}));
    EXPECT_EQ(report->page_frames, (std::vector<int>{1, 3}));
    EXPECT_THAT(report->notes,
                ::testing::Contains(
                    HasSubstr("2 of 3 frames were measured, those with a ground truth: 1, 3")));
    for (size_t v : {0, 1}) {
        const Series& mse = report->variants[v].metrics.at("mse");
        EXPECT_EQ(mse.frames[0], whole->variants[v].metrics.at("mse").frames[0]);
        EXPECT_FALSE(mse.frames[1]);
        EXPECT_TRUE(mse.frames[2]);
        EXPECT_FALSE(report->variants[v].metrics.at("tde").frames[2]);  // no difference to frame 2
        EXPECT_TRUE(report->variants[v].timing);
        EXPECT_EQ(report->variants[v].failure, "");
    }
    EXPECT_TRUE(report->variants[0].metrics.at("grid").frames[1]);  // it was filtered
    EXPECT_EQ(report->comparison->metrics[0].n, 2);
    EXPECT_FALSE(report->input_metrics.at("mse").frames[1]);
    EXPECT_TRUE(report->input_metrics.at("mse").frames[2]);
    std::filesystem::remove(folder_.path("truth.0001.exr"));
    std::filesystem::remove(folder_.path("truth.0003.exr"));
    part.folder = folder_.path("none");
    const auto none = run(test::kChainText, kNothing, part);
    EXPECT_EQ(none.status().code(), StatusCode::input);
    EXPECT_THAT(none.status().message(), HasSubstr("has no file for any of the 3 frames"));
}

// Also of frames that were not requested.
TEST_F(Ab, AChainGetsThePlanesOfTheFramesBeforeAndAfter) {
    auto two = settings();
    two.run.frames = io::FrameRange{{2, 3}};
    auto report = run_ab({"both", test::chain_of("echo")},
                         {"before", test::chain_of("echo", {{"neighbors", std::string("before")}})},
                         two, test::executor(), {}, nullptr);
    ASSERT_TRUE(report.ok()) << report.status().message();
    const StoredImage* stored = report->find(ImageKind::color, 0, 2);
    ASSERT_TRUE(stored);
    auto pixels = load_image(*report, *stored);
    ASSERT_TRUE(pixels.ok()) << pixels.status().message();
    std::vector<ImageF> colors;
    for (uint32_t frame : {1, 2, 3})
        colors.push_back(
            test::layered_frame(64, 40, {6, 2}, {-3, 1}, frame).planes.at(Role::color));
    for (int x = 0; x < 64; ++x)
        EXPECT_NEAR(pixels->at(x, 11, 1),
                    1.5f * colors[1].at(x, 11, 1) - 0.25f * colors[0].at(x, 11, 1) -
                        0.25f * colors[2].at(x, 11, 1),
                    2e-3);
    EXPECT_THAT(report->notes,
                ::testing::Contains("frame 3 is filtered without the frame after: frame 3 is the "
                                    "last on disk"));
}

TEST_F(Ab, OnlyChosenFramesKeepPictures) {
    auto few = settings();
    few.page_frames = 2;
    auto report = run(test::kChainText, kNothing, few);
    ASSERT_TRUE(report.ok());
    EXPECT_EQ(report->page_frames, (std::vector<int>{1, 3}));
    EXPECT_EQ(report->images.size(), 20u);
    EXPECT_FALSE(report->find(ImageKind::color, 0, 2));
}

TEST_F(Ab, AHoleInTheFramesHasNoStepInTime) {
    auto gap = settings();
    gap.run.frames = io::FrameRange{{1, 3}};
    auto report = run(test::kChainText, kNothing, gap);
    ASSERT_TRUE(report.ok());
    EXPECT_FALSE(report->variants[0].metrics.at("tde").mean);
    EXPECT_TRUE(report->variants[0].metrics.at("mse").mean);
}

TEST_F(Ab, EqualChainsAreEqual) {
    auto report = run(test::kChainText, test::kChainText, settings());
    ASSERT_TRUE(report.ok());
    EXPECT_THAT(report->comparison->verdict, HasSubstr("No measurable difference"));
    EXPECT_EQ(report->comparison->shared_steps, report->comparison->steps_b);
}

TEST_F(Ab, WithoutATruthTheSecondIsHeldAgainstTheFirst) {
    auto blind = settings();
    blind.truth.clear();
    auto report = run(kNothing, test::kChainText, blind);
    ASSERT_TRUE(report.ok()) << report.status().message();
    EXPECT_EQ(report->reference, "a");
    EXPECT_FALSE(report->truth);
    EXPECT_EQ(report->no_truth, "no ground truth given (-r)");
    EXPECT_FALSE(report->variants[0].metrics.count("mse"));
    EXPECT_GT(*report->variants[1].metrics.at("mse").mean, 0);
    EXPECT_FALSE(report->find(ImageKind::truth, -1, 1));
    EXPECT_TRUE(report->input_metrics.empty());
    EXPECT_TRUE(report->truth_noise.empty());
    EXPECT_FALSE(report->winner);
    EXPECT_THAT(report->comparison->verdict, HasSubstr("Without a ground truth"));
}

TEST_F(Ab, AChainThatFailsLeavesTheOther) {
    // Depth of field without a lens: no frame can be planned.
    auto report = run(test::kChainText, "postchain: 1\npasses: [depth_of_field]\n", settings());
    ASSERT_TRUE(report.ok()) << report.status().message();
    EXPECT_THAT(report->variants[1].failure, HasSubstr("frame 1: "));
    EXPECT_THAT(report->variants[1].failure, HasSubstr("focal_length_mm"));
    EXPECT_TRUE(report->variants[0].failure.empty());
    EXPECT_TRUE(report->variants[0].metrics.at("mse").mean);
    EXPECT_FALSE(report->variants[1].timing);
    EXPECT_THAT(report->comparison->verdict, HasSubstr("two failed"));
}

TEST_F(Ab, TimesNameSourceAndPasses) {
    auto report = run(test::kChainText, kNothing, settings());
    ASSERT_TRUE(report.ok());
    const Timing& timing = *report->variants[0].timing;
    ASSERT_EQ(timing.passes.size(), 2u);
    EXPECT_EQ(timing.passes[0].pass, "0.motion_blur");
    EXPECT_EQ(timing.passes[0].time.n, 2);
    EXPECT_GT(timing.total.median_ms, 0);
    EXPECT_FALSE(timing.source.empty());
    EXPECT_EQ(report->variants[1].timing->total.median_ms, 0);
}

// Every frame of a short sequence. A chain without random numbers has no flicker, one without tiles
// no grid; noise has no grid.
TEST_F(Ab, FlickerAndGridAreMeasuredOnEveryFrame) {
    auto report = run(test::kChainText, kNothing, settings());
    ASSERT_TRUE(report.ok());
    for (const char* metric : {"flicker", "grid"}) {
        const Series& series = report->variants[0].metrics.at(metric);
        for (size_t i = 0; i < 3; ++i) {
            ASSERT_TRUE(series.frames[i]) << metric << i;
            EXPECT_GT(*series.frames[i], 1e-4) << metric << i;
        }
        EXPECT_NE(*series.frames[0], *series.frames[1]) << metric;
        EXPECT_FALSE(report->variants[1].metrics.at(metric).mean) << metric;
    }
    auto again = settings();
    again.on_existing = io::OnExisting::overwrite;
    auto still = run_ab({"one", test::parse(test::kChainText, {"motion_blur.noise=none"})},
                        chain("two", kNothing), again, test::executor(), {}, nullptr);
    ASSERT_TRUE(still.ok()) << still.status().message();
    EXPECT_EQ(*still->variants[0].metrics.at("flicker").frames[0], 0);
}

TEST_F(Ab, StoredMapsAreThoseOfTheMetrics) {
    auto report = run(test::kChainText, kNothing, settings());
    ASSERT_TRUE(report.ok());
    for (const char* name : {"flip", "hdr_flip"}) {
        const StoredImage* stored = report->find(ImageKind::error, 1, 2, name);
        ASSERT_TRUE(stored) << name;
        auto map = load_image(*report, *stored);
        ASSERT_TRUE(map.ok());
        double sum = 0;
        for (const float v : map->data) sum += double(v);
        EXPECT_NEAR(sum / double(map->pixels()), *report->variants[1].metrics.at(name).frames[1],
                    1e-6)
            << name;
    }
    EXPECT_NE(*report->variants[1].metrics.at("flip").mean,
              *report->variants[1].metrics.at("hdr_flip").mean);
}

TEST_F(Ab, StopsWhenAsked) {
    const std::atomic<bool> stop = true;
    auto report = run_ab(chain("one", kNothing), chain("two", kNothing), settings(),
                         test::executor(), {}, &stop);
    EXPECT_EQ(report.status().code(), StatusCode::canceled);
}

TEST_F(Ab, FilesThatChangeMeanwhileAreAnError) {
    namespace fs = std::filesystem;
    for (const char* name : {"in.0001.exr", "in.0003.exr", "truth.0001.exr"}) {
        const std::string path = folder_.path(name);
        bool is_changed = false;
        auto report = run_ab(
            chain("one", kNothing), chain("two", kNothing), settings(), test::executor(),
            [&](const ExperimentProgress& progress) {
                if (progress.done != 1 || is_changed) return;
                is_changed = true;
                fs::last_write_time(path, fs::last_write_time(path) + std::chrono::seconds(1));
            },
            nullptr);
        EXPECT_TRUE(is_changed);
        EXPECT_EQ(report.status().code(), StatusCode::input) << name;
        EXPECT_THAT(report.status().message(), HasSubstr(std::string(name) + ": was changed"));
        fs::remove_all(folder_.path("report"));
    }
}

TEST_F(Ab, ProgressCountsFramesAndTimings) {
    size_t last = 0, total = 0;
    auto report = run_ab(
        chain("one", kNothing), chain("two", kNothing), settings(), test::executor(),
        [&](const ExperimentProgress& progress) {
            EXPECT_GE(progress.done, last);
            last = progress.done;
            total = progress.total;
        },
        nullptr);
    EXPECT_TRUE(report.ok());
    EXPECT_EQ(total, 5u);  // three frames, two timings
    EXPECT_EQ(last, total);
}

TEST_F(Ab, AReportThatIsThereIsRefused) {
    ASSERT_TRUE(run(kNothing, kNothing, settings()).ok());
    EXPECT_EQ(run(kNothing, kNothing, settings()).status().code(), StatusCode::output);
    auto again = settings();
    again.on_existing = io::OnExisting::overwrite;
    EXPECT_TRUE(run(kNothing, kNothing, again).ok());
}

}  // namespace
}  // namespace postchain::experiment
