// run_bench on small sequences.
#include "tools/measure/experiment/bench.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <fstream>

#include "tests/experiment/support.h"
#include "tests/support/images.h"
#include "tools/measure/experiment/ab.h"
#include "tools/measure/experiment/bench_store.h"
#include "tools/measure/experiment/report_folder.h"
#include "tools/measure/report/images.h"

namespace postchain::experiment {

using namespace report;
namespace {

using test::sweep;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::StartsWith;

class Bench : public ::testing::Test {
  protected:
    void SetUp() override {
        test::write_sequence(folder_.path(), 1, 2);
        test::write_truth(folder_.path(), "truth", 1, 2, 0.125f);
    }
    BenchSettings settings() {
        BenchSettings settings;
        static_cast<ExperimentSettings&>(settings) =
            test::settings_for(folder_.path(), folder_.path("report"));
        settings.on_existing = io::OnExisting::skip;
        settings.page_frames = 1;
        settings.chain_name = "small";
        return settings;
    }
    Result<Report> run(const std::vector<BenchVariant>& variants, const BenchSettings& settings,
                       const std::atomic<bool>* stop = nullptr,
                       const ProgressCallback& progress = {}) {
        const auto files = prepare_folder(settings);
        if (!files.ok()) return files.status();
        return run_bench(variants, settings, *files, test::executor(), progress, stop);
    }
    test::TempFolder folder_;
};

// Also files of a frame that is not measured: a result depends on them.
TEST_F(Bench, AChainGetsThePlanesOfTheFrameAfter) {
    const auto variants = [] {
        std::vector<BenchVariant> one;
        one.push_back({"echo", {}, test::chain_of("echo")});
        return one;
    };
    BenchSettings first = settings();
    first.run.frames = io::FrameRange{{1}};
    auto report = run(variants(), first);
    ASSERT_TRUE(report.ok()) << report.status().message();
    const auto color = [](uint32_t frame) {
        return test::layered_frame(64, 40, {6, 2}, {-3, 1}, frame).planes.at(Role::color);
    };
    const ImageF now = color(1), next = color(2);
    double mse = 0;
    for (size_t i = 0; i < now.pixels(); ++i) {
        for (size_t c = 0; c < 3; ++c) {
            const double off =
                0.5 * double(now.data[4 * i + c]) - 0.25 * double(next.data[4 * i + c]) - 0.125;
            mse += off * off / (3.0 * double(now.pixels()));
        }
    }
    EXPECT_NEAR(*report->variants[0].metrics.at("mse").frames[0], mse, 1e-5);
    EXPECT_LT(*report->variants[0].split->mse.precision, 1e-9);  // the reference used them too
    EXPECT_THAT(report->notes,
                ::testing::Contains(
                    "frame 1 is filtered without the frame before: frame 1 is the first on disk"));
    EXPECT_TRUE(run(variants(), first)->variants[0].resumed);
    const std::string after = folder_.path("in.0002.exr");
    std::filesystem::last_write_time(
        after, std::filesystem::last_write_time(after) + std::chrono::hours(1));
    EXPECT_FALSE(run(variants(), first)->variants[0].resumed);
}

TEST_F(Bench, EveryVariantHasMetricsTimesAndThreeParts) {
    auto variants = sweep({"motion_blur.samples=5,31"});
    auto report = run(*variants, settings());
    ASSERT_TRUE(report.ok()) << report.status().message();
    ASSERT_EQ(report->variants.size(), 2u);
    for (const Variant& variant : report->variants) {
        EXPECT_EQ(variant.failure, "");
        EXPECT_TRUE(variant.metrics.at("hdr_flip").mean);
        EXPECT_EQ(variant.timing->passes.size(), 2u);
        const ErrorSplit& split = *variant.split;
        EXPECT_EQ(split.frames, std::vector<int>{1});
        EXPECT_NEAR(*split.mse.total,
                    *split.mse.precision + *split.mse.sampling + *split.mse.model + *split.cross,
                    1e-12);
        // The split's total is the frame's metric.
        EXPECT_NEAR(*split.mse.total, *variant.metrics.at("mse").frames[0], 1e-9);
        EXPECT_LT(*split.mse.precision, 1e-6);
    }
    // Both share a converged image and so the model error. Fewer taps have more sampling error.
    EXPECT_DOUBLE_EQ(*report->variants[0].split->mse.model, *report->variants[1].split->mse.model);
    EXPECT_GT(*report->variants[0].split->mse.sampling,
              2 * *report->variants[1].split->mse.sampling);
    EXPECT_THAT(report->variants[0].split->convergence,
                ::testing::Contains("passes[0].motion_blur.samples 5 -> 401"));
    EXPECT_EQ(report->images.size(), 4u + 6u);  // input and its maps, truth; three of each
    EXPECT_EQ(report->title, "small: error against run time");
    EXPECT_EQ(report->pareto_metric, "hdr_flip");
}

TEST_F(Bench, AVariantWithAnotherShutterThanAGeneratedTruthIsWarnedOf) {
    BenchSettings with = settings();
    with.truth_cameras[2].shutter_frames = 0.25;
    const auto variants = sweep({"motion_blur.shutter_frames=0.25,0.75"});
    const auto report = run(*variants, with);
    ASSERT_TRUE(report.ok()) << report.status().message();
    EXPECT_THAT(report->warnings,
                ::testing::Contains(AllOf(HasSubstr(" filters frame 2 with shutter_frames 0.75 in "
                                                    "place of 0.25 of the generated"),
                                          StartsWith(variants->back().name))));
    EXPECT_THAT(report->warnings,
                Not(::testing::Contains(StartsWith(variants->front().name + " filters"))));
}

TEST_F(Bench, WithoutATruthModelErrorIsLeftOutAndSaidSo) {
    BenchSettings blind = settings();
    blind.truth.clear();
    blind.no_truth = "there is none";
    auto report = run(*sweep({"motion_blur.samples=5,31"}), blind);
    ASSERT_TRUE(report.ok()) << report.status().message();
    EXPECT_EQ(report->reference, "converged");
    EXPECT_FALSE(report->variants[0].split->mse.model);
    EXPECT_TRUE(report->input_metrics.empty());
    EXPECT_FALSE(report->winner);
    EXPECT_TRUE(report->variants[0].split->mse.sampling);
    EXPECT_THAT(report->variants[0].split->notes[0], HasSubstr("there is none"));
    EXPECT_THAT(report->notes[0], HasSubstr("no model error: there is none"));
    // The image they were measured against is stored once for both.
    const StoredImage* converged = report->find(ImageKind::converged, 0, 1);
    ASSERT_TRUE(converged && report->find(ImageKind::converged, 1, 1));
    EXPECT_EQ(converged->path, report->find(ImageKind::converged, 1, 1)->path);
    auto many = load_image(*report, *converged);
    auto few = load_image(*report, *report->find(ImageKind::color, 0, 1));
    ASSERT_TRUE(many.ok() && few.ok());
    EXPECT_NEAR(mean_squared(*few, *many), *report->variants[0].metrics.at("mse").frames[0], 1e-9);
    // A missing image is made again.
    std::filesystem::remove(report->folder + "/" + converged->path);
    report = run(*sweep({"motion_blur.samples=5,31"}), blind);
    EXPECT_TRUE(load_image(*report, *report->find(ImageKind::converged, 1, 1)).ok());
    // Measured against the converged filter, more taps are closer.
    EXPECT_GT(*report->variants[0].metrics.at("mse").mean,
              *report->variants[1].metrics.at("mse").mean);
}

// The ground truth is the input + 1/4, then + 1; a chain without passes returns the input. Its
// error grows by 3/4 from the first frame to the second.
TEST_F(Bench, TdeIsTheStepFromTheFrameBefore) {
    test::write_sequence(folder_.path(), 1, 4);
    test::write_truth(folder_.path(), "truth", 1, 1, 0.25f);
    test::write_truth(folder_.path(), "truth", 2, 1, 1.0f);
    test::write_truth(folder_.path(), "truth", 4, 1, 0.0f);
    BenchSettings some = settings();
    some.run.frames = io::FrameRange{{1, 2, 4}};
    std::vector<BenchVariant> variants(1);
    variants[0].name = "nothing";
    variants[0].chain = test::parse("postchain: 1\npasses: []\n");
    auto report = run(variants, some);
    ASSERT_TRUE(report.ok()) << report.status().message();
    const Series& tde = report->variants[0].metrics.at("tde");
    ASSERT_EQ(tde.frames.size(), 3u);
    EXPECT_FALSE(tde.frames[0]);
    EXPECT_NEAR(*tde.frames[1], 0.75, 1e-6);
    EXPECT_FALSE(tde.frames[2]);  // frame 3 is not in the bench
    // Another ground truth of the previous frame causes a new result, although frames 2 and 4, the
    // brightest and the darkest, keep the exposures unchanged.
    const double start = report->exposure_start, stop = report->exposure_stop;
    test::write_truth(folder_.path(), "truth", 1, 1, 0.375f);
    report = run(variants, some);
    EXPECT_EQ(report->exposure_start, start);
    EXPECT_EQ(report->exposure_stop, stop);
    EXPECT_NEAR(*report->variants[0].metrics.at("tde").frames[1], 0.625, 1e-6);
    report = run(variants, some);
    EXPECT_NEAR(*report->variants[0].metrics.at("tde").frames[1], 0.625, 1e-6);
}

TEST_F(Bench, ATruthForAPartOfTheFrames) {
    std::filesystem::remove(folder_.path("truth.0001.exr"));
    auto report = run(*sweep({"motion_blur.samples=5,9"}), settings());
    ASSERT_TRUE(report.ok()) << report.status().message();
    EXPECT_EQ(report->scored_frames, std::vector<int>{2});
    EXPECT_EQ(report->page_frames, std::vector<int>{2});
    for (const Variant& variant : report->variants) {
        EXPECT_EQ(variant.failure, "");
        EXPECT_FALSE(variant.metrics.at("mse").frames[0]);
        EXPECT_TRUE(variant.metrics.at("mse").frames[1]);
        EXPECT_TRUE(variant.metrics.at("grid").frames[0]);
        EXPECT_EQ(variant.metrics.count("tde"), 0u);
        EXPECT_EQ(variant.split->frames, std::vector<int>{2});
        EXPECT_TRUE(variant.split->mse.model);
        EXPECT_EQ(variant.timing->frame, 1);
    }
    // A ground truth added later is measured.
    test::write_truth(folder_.path(), "truth", 1, 1, 0.125f);
    report = run(*sweep({"motion_blur.samples=5,9"}), settings());
    ASSERT_TRUE(report.ok()) << report.status().message();
    EXPECT_TRUE(report->variants[0].metrics.at("mse").frames[0]);
    EXPECT_TRUE(report->variants[0].metrics.at("tde").frames[1]);
}

TEST_F(Bench, MeasuresWhatAbMeasures) {
    auto variants = sweep({"motion_blur.samples=9"});
    auto report = run(*variants, settings());
    ASSERT_TRUE(report.ok()) << report.status().message();
    auto both = settings();
    both.folder = folder_.path("ab");
    auto other =
        run_ab({"one", variants->at(0).chain.clone()}, {"two", test::parse(test::kChainText)}, both,
               test::executor(), {}, nullptr);
    ASSERT_TRUE(other.ok()) << other.status().message();
    size_t compared = 0;
    for (const auto& column : metric_columns(Kind::bench, true)) {
        for (size_t i = 0; i < 2; ++i) {
            const auto value = [&](const Report& of) -> std::optional<double> {
                const auto series = of.variants[0].metrics.find(column.name);
                return series == of.variants[0].metrics.end() ? std::nullopt
                                                              : series->second.frames[i];
            };
            ASSERT_EQ(value(*report).has_value(), value(*other).has_value()) << column.name << i;
            if (!value(*report)) continue;
            EXPECT_NEAR(*value(*report), *value(*other), 1e-6) << column.name << i;
            ++compared;
        }
    }
    EXPECT_GE(compared, 30u);
    for (const auto& [of, other_of] : {std::pair{&report->input_metrics, &other->input_metrics},
                                       std::pair{&report->truth_noise, &other->truth_noise}}) {
        ASSERT_EQ(of->size(), other_of->size());
        for (const auto& [name, series] : *of)
            EXPECT_EQ(series.frames, other_of->at(name).frames) << name;
    }
    EXPECT_GE(report->input_metrics.size(), 14u);
}

// Results of an earlier program lack a score of the input: only that is made, and everything else
// is reused.
TEST_F(Bench, ResultsWithoutAScoreOfTheInputGoOn) {
    auto variants = sweep({"motion_blur.samples=5,9"});
    auto report = run(*variants, settings());
    ASSERT_TRUE(report.ok()) << report.status().message();
    for (const char* name : {"input.1", "input.2", "truth.2"})
        ASSERT_TRUE(std::filesystem::remove(folder_.path(concat("report/results/", name, ".json"))))
            << name;
    std::filesystem::remove(folder_.path("report/images/input.hdr_flip.0001.exr"));
    auto again = run(*variants, settings());
    ASSERT_TRUE(again.ok()) << again.status().message();
    EXPECT_TRUE(again->variants[0].resumed && again->variants[1].resumed);
    EXPECT_EQ(again->input_metrics.at("hdr_flip").frames,
              report->input_metrics.at("hdr_flip").frames);
    EXPECT_EQ(again->truth_noise.at(kNoiseSigma).frames,
              report->truth_noise.at(kNoiseSigma).frames);
    EXPECT_TRUE(load_image(*again, *again->find(ImageKind::error, -1, 1, "hdr_flip")).ok());
    // Another ground truth gives another score.
    test::write_truth(folder_.path(), "truth", 1, 2, 0.25f);
    again = run(*variants, settings());
    EXPECT_NEAR(*again->input_metrics.at("mse").mean, 1.0 / 16, 1e-6);
}

TEST_F(Bench, AVariantThatFailsLeavesTheOthers) {
    auto variants = sweep({"motion_blur.samples=5"});
    BenchVariant lens;
    lens.name = "lens";
    lens.chain = test::parse("postchain: 1\npasses: [depth_of_field]\n");  // no camera
    variants->insert(variants->begin(), std::move(lens));
    auto report = run(*variants, settings());
    ASSERT_TRUE(report.ok()) << report.status().message();
    EXPECT_THAT(report->variants[0].failure, HasSubstr("frame 1: "));
    EXPECT_FALSE(report->variants[0].timing);
    EXPECT_FALSE(report->variants[0].pareto);
    EXPECT_EQ(report->variants[1].failure, "");
    EXPECT_TRUE(report->variants[1].pareto);
}

// Stopped after each unit of work: the number done never exceeds the total, and reaches it at the
// end.
TEST_F(Bench, ProgressIsTrueWhereverItWasStopped) {
    auto variants = sweep({"motion_blur.samples=5,9"});
    BenchVariant lens;
    lens.name = "lens";
    lens.chain = test::parse("postchain: 1\npasses: [depth_of_field]\n");  // fails on every frame
    variants->push_back(std::move(lens));
    constexpr size_t kUnits = 3 * 2 + 3;
    for (size_t at = 0; at <= kUnits; ++at) {
        BenchSettings here = settings();
        here.folder = folder_.path(concat("report", at));
        std::atomic<bool> stop = false;
        size_t last = 0;
        const auto watch = [&](const ExperimentProgress& progress) {
            EXPECT_EQ(progress.total, kUnits);
            EXPECT_GE(progress.done, last) << "stopped at " << at;
            EXPECT_LE(progress.done, kUnits) << "stopped at " << at;
            last = progress.done;
        };
        const auto stopped = run(*variants, here, &stop, [&](const ExperimentProgress& progress) {
            watch(progress);
            if (progress.done == at) stop = true;
        });
        // After the last unit nothing can be stopped; only failed work is tried again.
        EXPECT_EQ(stopped.ok(), at == kUnits) << at;
        last = 0;
        const auto resumed = run(*variants, here, nullptr, watch);
        ASSERT_TRUE(resumed.ok()) << resumed.status().message();
        EXPECT_EQ(last, kUnits) << "stopped at " << at;
    }
}

TEST_F(Bench, GoesOnWhereItWasStopped) {
    auto variants = sweep({"motion_blur.samples=5,9,13"});
    std::atomic<bool> stop = false;
    // Stops when the second unit of work is done.
    auto stopped = run(*variants, settings(), &stop, [&](const ExperimentProgress& progress) {
        if (progress.done == 2) stop = true;
    });
    EXPECT_EQ(stopped.status().code(), StatusCode::canceled);
    size_t first = 99, total = 0;
    auto resumed = run(*variants, settings(), nullptr, [&](const ExperimentProgress& progress) {
        first = std::min(first, progress.done);
        total = progress.total;
    });
    ASSERT_TRUE(resumed.ok()) << resumed.status().message();
    EXPECT_EQ(first, 2u);
    EXPECT_EQ(total, 9u);  // three variants, two frames, and a timing each
    EXPECT_TRUE(resumed->variants[0].resumed);
    EXPECT_TRUE(resumed->variants[1].resumed);
    EXPECT_FALSE(resumed->variants[2].resumed);
    // Equal to a run without the stop, bit for bit except for times.
    BenchSettings whole = settings();
    whole.folder = folder_.path("whole");
    auto straight = run(*variants, whole);
    ASSERT_TRUE(straight.ok());
    for (size_t v = 0; v < 3; ++v) {
        for (const auto& [name, series] : straight->variants[v].metrics)
            EXPECT_EQ(series.frames, resumed->variants[v].metrics.at(name).frames) << name;
        EXPECT_EQ(straight->variants[v].split->mse.model, resumed->variants[v].split->mse.model);
    }
    EXPECT_EQ(straight->images.size(), resumed->images.size());
    EXPECT_EQ(straight->crops.size(), resumed->crops.size());
    // The third run has nothing left to do.
    size_t work = 0;
    auto again = run(*variants, settings(), nullptr, [&](const ExperimentProgress&) { ++work; });
    ASSERT_TRUE(again.ok());
    EXPECT_EQ(work, 0u);
    EXPECT_TRUE(again->variants[2].resumed);
}

// A result measured before a file changed does not count for the changed file.
TEST_F(Bench, FilesThatChangeMeanwhileAreAnErrorAndLeaveNoResult) {
    namespace fs = std::filesystem;
    auto variants = sweep({"motion_blur.samples=5,9"});
    for (const char* name : {"in.0001.exr", "truth.0001.exr"}) {
        const std::string path = folder_.path(name);
        bool is_changed = false;
        auto report = run(*variants, settings(), nullptr, [&](const ExperimentProgress& progress) {
            if (progress.done != 1 || is_changed) return;
            is_changed = true;
            fs::last_write_time(path, fs::last_write_time(path) + std::chrono::seconds(1));
        });
        EXPECT_EQ(report.status().code(), StatusCode::input) << name;
        EXPECT_THAT(report.status().message(), HasSubstr(std::string(name) + ": was changed"));
        size_t first = 99;
        ASSERT_TRUE(run(*variants, settings(), nullptr, [&](const ExperimentProgress& progress) {
                        first = std::min(first, progress.done);
                    }).ok());
        EXPECT_EQ(first, 0u) << name;
        fs::remove_all(folder_.path("report"));
    }
}

TEST_F(Bench, ResultsOfAnotherInputTruthOrDeviceAreNotUsed) {
    auto variants = sweep({"motion_blur.samples=5"});
    ASSERT_TRUE(run(*variants, settings()).ok());
    ASSERT_TRUE(run(*variants, settings())->variants[0].resumed);
    BenchSettings other = settings();
    other.renderer = "another device";
    EXPECT_FALSE(run(*variants, other)->variants[0].resumed);
    // Elision settings change the report and the times.
    other = settings();
    other.run.plan.rules_off = {kRuleUnusedStep};
    EXPECT_FALSE(run(*variants, other)->variants[0].resumed);
    EXPECT_TRUE(run(*variants, other)->variants[0].resumed);
    ASSERT_TRUE(run(*variants, settings()).ok());
    test::write_truth(folder_.path(), "truth", 1, 2, 0.25f);
    auto report = run(*variants, settings());
    EXPECT_FALSE(report->variants[0].resumed);
    // A missing image is made again.
    const StoredImage* image = report->find(ImageKind::color, 0, 1);
    std::filesystem::remove(folder_.path("report") + "/" + image->path);
    report = run(*variants, settings());
    EXPECT_TRUE(load_image(*report, *report->find(ImageKind::color, 0, 1)).ok());
}

TEST(BenchResults, BrokenFilesAreNoResults) {
    const test::TempFolder folder;
    const BenchStore store(folder.path(), "here", io::OutputFiles());
    ASSERT_TRUE(store.prepare().ok());
    FrameResult result;
    result.metrics["flip"] = 0.25;
    result.elisions.push_back({.pass = 2,
                               .kind = ElisionKind::step,
                               .item = "luma",
                               .rule = "rule",
                               .fact = {"largest luma", 0.125, 0.5, "px", Fact::Relation::below},
                               .saving = {1, 2, 3}});
    result.elisions.push_back({.kind = ElisionKind::plane, .item = "motion", .fact = {"unread"}});
    ASSERT_TRUE(store.keep("abc", 7, "work", result).ok());
    auto back = store.frame("abc", 7, "work");
    ASSERT_TRUE(back);
    EXPECT_EQ(back->metrics, result.metrics);
    EXPECT_EQ(back->elisions, result.elisions);
    EXPECT_FALSE(back->split);
    EXPECT_FALSE(store.frame("abc", 7, "other work"));
    EXPECT_FALSE(store.frame("abc", 8, "work"));
    EXPECT_FALSE(BenchStore(folder.path(), "there", io::OutputFiles()).frame("abc", 7, "work"));
    for (const char* text : {"", "{", "[]", "{\"key\": 3}"}) {
        std::ofstream(folder.path("results/abc.7.json")) << text;
        EXPECT_FALSE(store.frame("abc", 7, "work")) << text;
    }
    EXPECT_FALSE(store.timing("abc", "work"));
}

}  // namespace
}  // namespace postchain::experiment
