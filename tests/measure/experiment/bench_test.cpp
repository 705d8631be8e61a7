// run_bench on small sequences.
#include "tools/measure/experiment/run_experiment.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <functional>

#include "tests/measure/experiment/support.h"
#include "tests/support/status.h"
#include "tests/support/text_file.h"
#include "tools/measure/experiment/report_folder.h"
#include "tools/measure/experiment/result_store.h"
#include "tools/measure/report/images.h"
#include "tools/sequence/files/json.h"

namespace postchain::experiment {

using namespace report;
namespace {

using test::sweep;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::StartsWith;

// A result of other conditions is not used again.
TEST(Conditions, NameWhatDecidesAResult) {
    using Change = std::function<void(Report&, ExperimentSettings&, RuleNames&)>;
    const std::pair<const char*, Change> changes[] = {
        {"nothing", [](Report&, ExperimentSettings&, RuleNames&) {}},
        {"version", [](Report& r, ExperimentSettings&, RuleNames&) { r.version = "x"; }},
        {"renderer", [](Report& r, ExperimentSettings&, RuleNames&) { r.renderer = "x"; }},
        {"threads", [](Report& r, ExperimentSettings&, RuleNames&) { r.threads = 3; }},
        {"precision", [](Report& r, ExperimentSettings&, RuleNames&) { r.precision = "x"; }},
        {"tone mapper", [](Report& r, ExperimentSettings&, RuleNames&) { r.tone_mapper = "x"; }},
        {"start", [](Report& r, ExperimentSettings&, RuleNames&) { r.exposure_start = 3; }},
        {"stop", [](Report& r, ExperimentSettings&, RuleNames&) { r.exposure_stop = 3; }},
        {"reference", [](Report& r, ExperimentSettings&, RuleNames&) { r.reference = "x"; }},
        {"row",
         [](Report& r, ExperimentSettings&, RuleNames&) {
             r.slice = Slice{3, 1, 1};
         }},
        {"left",
         [](Report& r, ExperimentSettings&, RuleNames&) {
             r.slice = Slice{1, 3, 1};
         }},
        {"width",
         [](Report& r, ExperimentSettings&, RuleNames&) {
             r.slice = Slice{1, 1, 3};
         }},
        {"repeats", [](Report&, ExperimentSettings& s, RuleNames&) { s.repeats = 3; }},
        {"ppd", [](Report&, ExperimentSettings& s, RuleNames&) { s.flip.pixels_per_degree = 3; }},
        {"rule", [](Report&, ExperimentSettings&, RuleNames& rules) { rules.insert("x"); }},
    };
    std::map<std::string, std::string> names;
    for (const auto& [name, change] : changes) {
        Report report;
        ExperimentSettings settings;
        RuleNames rules = {"facts"};
        change(report, settings, rules);
        const auto [same, is_new] = names.try_emplace(conditions_of(report, settings, rules), name);
        EXPECT_TRUE(is_new) << name << " has the conditions of " << same->second;
    }
}

class Bench : public ::testing::Test {
  protected:
    void SetUp() override {
        test::write_sequence(folder_.path(), 2);
        test::write_truth(folder_.path(), 1, 2, 0.125f);
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
    Result<Report> run(const std::vector<NamedChain>& variants, const BenchSettings& settings,
                       const std::atomic<bool>* stop = nullptr,
                       const ProgressCallback& progress = {}) {
        const auto files = prepare_folder(settings);
        if (!files.ok()) return files.status();
        return run_bench(variants, settings, *files, test::executor(), progress, stop);
    }
    Report done(const std::vector<NamedChain>& variants, const BenchSettings& settings) {
        return test::must(run(variants, settings));
    }
    test::TempFolder folder_;
};

std::vector<NamedChain> swept(const char* samples) {
    return test::must(sweep({std::string("motion_blur.samples=") + samples}));
}

NamedChain variant(const char* name, Chain chain) {
    return {name, std::move(chain)};
}

// Fails on every frame: there is no camera.
NamedChain lens() {
    return variant("lens", test::parse("postchain: 1\npasses: [depth_of_field]\n"));
}

// A result depends on the files of the frames beside its own, measured or not.
TEST_F(Bench, AFrameIsMeasuredAgainWhenTheNextOneChanges) {
    namespace fs = std::filesystem;
    std::vector<NamedChain> variants;
    variants.push_back(variant("echo", test::chain_of("echo")));
    BenchSettings first = settings();
    first.run.frames = io::FrameRange{{1}};
    const Report report = done(variants, first);
    EXPECT_LT(*report.variants[0].split->mse.precision, 1e-9);  // the reference used them too
    EXPECT_THAT(report.notes,
                ::testing::Contains(
                    "frame 1 is filtered without the frame before: frame 1 is the first on disk"));
    EXPECT_TRUE(done(variants, first).variants[0].resumed);
    const std::string after = folder_.path("in.0002.exr");
    fs::last_write_time(after, fs::last_write_time(after) + std::chrono::hours(1));
    EXPECT_FALSE(done(variants, first).variants[0].resumed);
}

TEST_F(Bench, EveryVariantHasMetricsTimesAndThreeParts) {
    const Report report = done(swept("5,31"), settings());
    ASSERT_EQ(report.variants.size(), 2u);
    for (const Variant& variant : report.variants) {
        EXPECT_EQ(variant.failure, "");
        EXPECT_TRUE(variant.metrics.at("hdr_flip").mean);
        EXPECT_EQ(variant.timing->passes.size(), 2u);
        EXPECT_FALSE(variant.timing->trustworthy);
        EXPECT_EQ(variant.timing->why_not, "fewer than 5 repetitions");
        EXPECT_FALSE(variant.pareto);
        const ErrorSplit& split = *variant.split;
        EXPECT_EQ(split.frames, std::vector<int>{1});
        // The split's total is the frame's metric.
        EXPECT_NEAR(*split.mse.total, *variant.metrics.at("mse").frames[0], 1e-9);
        EXPECT_LT(*split.mse.precision, 1e-6);
    }
    // Both share a converged image and so the model error. Fewer taps have more sampling error.
    const ErrorParts &few = report.variants[0].split->mse, &many = report.variants[1].split->mse;
    EXPECT_DOUBLE_EQ(*few.model, *many.model);
    EXPECT_GT(*few.sampling, 2 * *many.sampling);
    EXPECT_THAT(report.variants[0].split->convergence,
                ::testing::Contains("passes[0].motion_blur.samples 5 -> 401"));
    // For one frame: input and its maps, truth; 3 for each variant. Slices over time.
    EXPECT_EQ(report.images.size(), 4u + 6u + 3u);
    EXPECT_EQ(report.find(ImageKind::color, 0, 1)->width, report.width);
    EXPECT_EQ(report.find(ImageKind::color, 0, 1)->height, report.height);
    EXPECT_FALSE(report.find(ImageKind::color, 0, 2));
    EXPECT_EQ(report.title, "small: error against run time");
    EXPECT_EQ(report.pareto_metric, "hdr_flip");
}

TEST_F(Bench, AVariantWithAnotherShutterThanAGeneratedTruthIsWarnedOf) {
    BenchSettings with = settings();
    with.truth_cameras[2].shutter_frames = 0.25;
    const auto variants = test::must(sweep({"motion_blur.shutter_frames=0.25,0.75"}));
    const Report report = done(variants, with);
    EXPECT_THAT(report.warnings,
                ::testing::Contains(AllOf(HasSubstr(" filters frame 2 with shutter_frames 0.75 in "
                                                    "place of 0.25 of the generated"),
                                          StartsWith(variants.back().name))));
    EXPECT_THAT(report.warnings,
                Not(::testing::Contains(StartsWith(variants.front().name + " filters"))));
}

// Without a generated truth nothing says which camera it was rendered with.
TEST_F(Bench, VariantsOfOneTruthWithSeveralCamerasAreNoted) {
    const auto noted = [&](const BenchSettings& with, const char* key) {
        const Report report = done(test::must(sweep({key})), with);
        return std::ranges::count(report.notes,
                                  "variants differ in camera but share one ground truth");
    };
    BenchSettings blind = settings();
    blind.truth.clear();
    EXPECT_EQ(noted(settings(), "camera.f_stop=2,4,8"), 1);
    EXPECT_EQ(noted(settings(), "motion_blur.samples=5,7,9"), 0);
    EXPECT_EQ(noted(blind, "camera.f_stop=2,4"), 0);
}

TEST_F(Bench, WithoutATruthModelErrorIsLeftOutAndSaidSo) {
    BenchSettings blind = settings();
    blind.truth.clear();
    blind.no_truth = "there is none";
    Report report = done(swept("5,31"), blind);
    EXPECT_EQ(report.reference, "converged");
    EXPECT_FALSE(report.variants[0].split->mse.model);
    EXPECT_TRUE(report.variants[0].split->mse.sampling);
    EXPECT_TRUE(report.input_metrics.empty());
    EXPECT_FALSE(report.winner);
    EXPECT_THAT(report.notes[0], HasSubstr("no model error: there is none"));
    // The image they were measured against is stored once for both.
    const StoredImage* converged = report.find(ImageKind::converged, 0, 1);
    ASSERT_TRUE(converged && report.find(ImageKind::converged, 1, 1));
    EXPECT_EQ(converged->path, report.find(ImageKind::converged, 1, 1)->path);
    const ImageF many = test::must(load_image(report, *converged));
    const ImageF few = test::must(load_image(report, *report.find(ImageKind::color, 0, 1)));
    EXPECT_NEAR(mean_squared(few, many), *report.variants[0].metrics.at("mse").frames[0], 1e-9);
    // A missing image is made again.
    std::filesystem::remove(report.folder + "/" + converged->path);
    report = done(swept("5,31"), blind);
    EXPECT_TRUE(load_image(report, *report.find(ImageKind::converged, 1, 1)).ok());
    // Measured against the converged filter, more taps are closer.
    EXPECT_GT(*report.variants[0].metrics.at("mse").mean,
              *report.variants[1].metrics.at("mse").mean);
}

// The ground truth is the input + 1/4, then + 1; a chain without passes returns the input. Its
// error grows by 3/4 from the first frame to the second.
TEST_F(Bench, TdeIsTheStepFromTheFrameBefore) {
    test::write_sequence(folder_.path(), 4);
    for (const auto& [frame, offset] : {std::pair{1, 0.25f}, {2, 1.0f}, {4, 0.0f}})
        test::write_truth(folder_.path(), frame, 1, offset);
    BenchSettings some = settings();
    some.run.frames = io::FrameRange{{1, 2, 4}};
    std::vector<NamedChain> variants;
    variants.push_back(variant("nothing", test::parse("postchain: 1\npasses: []\n")));
    Report report = done(variants, some);
    const Series tde = report.variants[0].metrics.at("tde");
    ASSERT_EQ(tde.frames.size(), 3u);
    EXPECT_FALSE(tde.frames[0]);
    EXPECT_NEAR(*tde.frames[1], 0.75, 1e-6);
    EXPECT_FALSE(tde.frames[2]);  // frame 3 is not in the bench
    // Another ground truth of the previous frame causes a new result, although frames 2 and 4, the
    // brightest and the darkest, keep the exposures unchanged.
    const double start = report.exposure_start, stop = report.exposure_stop;
    test::write_truth(folder_.path(), 1, 1, 0.375f);
    for (int run = 0; run < 2; ++run) {
        report = done(variants, some);
        EXPECT_EQ(report.exposure_start, start);
        EXPECT_EQ(report.exposure_stop, stop);
        EXPECT_NEAR(*report.variants[0].metrics.at("tde").frames[1], 0.625, 1e-6);
        // The slices over time: a row for each frame, also from the results of the first run.
        const auto slice = [&](int variant) {
            return test::must(load_image(report, *report.find(ImageKind::slice, variant, 1)));
        };
        const ImageF truth = slice(-1), nothing = slice(0);
        ASSERT_EQ(nothing.width, report.slice->width);
        ASSERT_EQ(nothing.height, 3);
        for (const auto& [i, offset] : {std::pair{0, 0.375f}, {1, 1.0f}, {2, 0.0f}})
            for (int x = 0; x < nothing.width; ++x)
                EXPECT_NEAR(truth.at(x, i) - nothing.at(x, i), offset, 1e-6);
        const ImageF second = test::must(load_image(report, *report.find(ImageKind::color, 0, 1)));
        for (int x = 0; x < nothing.width; ++x)
            EXPECT_EQ(nothing.at(x, 0, 1), second.at(report.slice->left + x, report.slice->row, 1));
    }
}

// Results that are resumed, with slices of another width.
TEST_F(Bench, ASliceOfADamagedResultIsLeftOut) {
    std::vector<NamedChain> variants;
    variants.push_back(variant("nothing", test::parse("postchain: 1\npasses: []\n")));
    const auto row = [&](int frame) {
        const Report report = done(variants, settings());
        const ImageF slice = test::must(load_image(report, *report.find(ImageKind::slice, 0, 1)));
        return std::pair(slice.at(0, frame - 1), slice.at(slice.width - 1, frame - 1));
    };
    const auto whole = row(2);
    for (const size_t values : {3, 300'000}) {
        const std::string path =
            folder_.path(concat("report/results/", hex_of(variants[0].chain.hash()), ".1.json"));
        io::Json json = io::Json::parse(test::read_text(path));
        json["slice"] = std::vector<float>(values, 0.5f);
        test::write_text(path, json.dump());
        EXPECT_TRUE(std::isnan(row(1).first) && std::isnan(row(1).second)) << values;
        EXPECT_EQ(row(2), whole);
    }
}

TEST_F(Bench, ATruthForAPartOfTheFrames) {
    std::filesystem::remove(folder_.path("truth.0001.exr"));
    Report report = done(swept("5"), settings());
    const Variant& variant = report.variants[0];
    EXPECT_TRUE(variant.metrics.at("grid").frames[0]);
    EXPECT_EQ(variant.metrics.count("tde"), 0u);
    EXPECT_EQ(variant.split->frames, std::vector<int>{2});
    EXPECT_TRUE(variant.split->mse.model);
    EXPECT_EQ(variant.timing->frame, 1);
    // A ground truth added later is measured.
    test::write_truth(folder_.path(), 1, 1, 0.125f);
    report = done(swept("5"), settings());
    EXPECT_TRUE(report.variants[0].metrics.at("mse").frames[0]);
    EXPECT_TRUE(report.variants[0].metrics.at("tde").frames[1]);
}

// With the planes of the frames beside each, which echo reads.
TEST_F(Bench, MeasuresWhatAbMeasures) {
    Chain chain = test::parse(test::kChainText);
    test::append(chain, "echo");
    std::vector<NamedChain> variants;
    variants.push_back(variant("one", chain.clone()));
    const Report report = done(variants, settings());
    auto both = settings();
    both.folder = folder_.path("ab");
    const Report other =
        test::must(run_ab({"one", std::move(chain)}, {"two", test::parse(test::kChainText)}, both,
                          test::executor(), {}, nullptr));
    const Metrics &here = report.variants[0].metrics, &there = other.variants[0].metrics;
    const size_t compared = test::expect_same_values(here, there);
    EXPECT_GE(compared, 30u);
    EXPECT_EQ(compared, test::expect_same_values(there, there));  // ab has no other value
    for (const auto& [of, other_of] : {std::pair{&report.input_metrics, &other.input_metrics},
                                       std::pair{&report.truth_noise, &other.truth_noise}}) {
        EXPECT_EQ(of->size(), other_of->size());
        test::expect_same_values(*of, *other_of);
    }
}

// Stopped after each unit of work: progress reaches the total and never exceeds it, finished work
// is not repeated, and the report equals that of a run without a stop, bit for bit except for
// times.
TEST_F(Bench, GoesOnWhereverItWasStopped) {
    auto variants = swept("5,9");
    variants.push_back(lens());
    constexpr size_t kUnits = 3 * 2 + 3;  // three variants, two frames, and a timing each
    BenchSettings whole = settings();
    whole.folder = folder_.path("whole");
    whole.repeats = report::kTrustedRepeats;
    const Report straight = done(variants, whole);
    EXPECT_THAT(straight.variants[2].failure,
                AllOf(HasSubstr("frame 1: "), HasSubstr("focal_length_mm")));
    EXPECT_FALSE(straight.variants[2].timing || straight.variants[2].pareto);
    EXPECT_TRUE(straight.variants[0].failure.empty() && straight.variants[0].pareto);
    for (size_t at = 0; at <= kUnits; ++at) {
        SCOPED_TRACE(concat("stopped at ", at));
        BenchSettings here = settings();
        here.folder = folder_.path(concat("report", at));
        std::atomic<bool> stop = false;
        std::optional<size_t> first;
        size_t last = 0;
        const auto watch = [&](const ExperimentProgress& progress) {
            EXPECT_EQ(progress.total, kUnits);
            EXPECT_GE(progress.done, last);
            EXPECT_LE(progress.done, kUnits);
            last = progress.done;
            if (!first) first = last;
        };
        const auto stopped = run(variants, here, &stop, [&](const ExperimentProgress& progress) {
            watch(progress);
            if (progress.done == at) stop = true;
        });
        // After the last unit nothing can be stopped; only failed work is tried again.
        EXPECT_EQ(stopped.status().code(), at < kUnits ? StatusCode::canceled : StatusCode::ok);
        last = 0;
        first.reset();
        const Report resumed = test::must(run(variants, here, nullptr, watch));
        EXPECT_EQ(last, kUnits);
        if (at <= 6) {
            EXPECT_EQ(first, at - at / 3);  // every third is the lens, which is tried again
        }
        for (size_t v = 0; v < 2; ++v) {
            for (const auto& [name, series] : straight.variants[v].metrics)
                EXPECT_EQ(series.frames, resumed.variants[v].metrics.at(name).frames) << name;
            EXPECT_EQ(straight.variants[v].split->mse.model, resumed.variants[v].split->mse.model);
        }
        EXPECT_EQ(straight.images.size(), resumed.images.size());
        EXPECT_EQ(straight.crops.size(), resumed.crops.size());
    }
}

// A result measured before a file changed does not count for the changed file.
TEST_F(Bench, FilesThatChangeMeanwhileAreAnErrorAndLeaveNoResult) {
    namespace fs = std::filesystem;
    const auto variants = swept("5");
    for (const std::string name : {"in.0001.exr", "in.0002.exr", "truth.0001.exr"}) {
        const std::string path = folder_.path(name);
        bool is_changed = false;
        const auto report =
            run(variants, settings(), nullptr, [&](const ExperimentProgress& progress) {
                if (progress.done != 1 || is_changed) return;
                is_changed = true;
                fs::last_write_time(path, fs::last_write_time(path) + std::chrono::seconds(1));
            });
        EXPECT_EQ(report.status().code(), StatusCode::input) << name;
        EXPECT_THAT(test::error_of(report), HasSubstr(name + ": was changed"));
        // Frame 1 does not depend on the input's frame 2.
        EXPECT_EQ(done(variants, settings()).variants[0].resumed, name == "in.0002.exr") << name;
        fs::remove_all(folder_.path("report"));
    }
}

// Looking at the files of all frames for each frame would be quadratic.
TEST_F(Bench, AFileThatChangesLeavesTheResultsOfFramesFarFromIt) {
    namespace fs = std::filesystem;
    test::write_sequence(folder_.path(), 6);
    test::write_truth(folder_.path(), 1, 6, 0.125f);
    const auto variants = swept("5");
    const std::string path = folder_.path("in.0006.exr");
    const auto report = run(variants, settings(), nullptr, [&](const ExperimentProgress& progress) {
        if (progress.done == 1)
            fs::last_write_time(path, fs::last_write_time(path) + std::chrono::seconds(1));
    });
    EXPECT_THAT(test::error_of(report), HasSubstr("in.0006.exr: was changed"));
    size_t kept = 100;
    ASSERT_TRUE(run(variants, settings(), nullptr, [&](const ExperimentProgress& progress) {
                    kept = std::min(kept, progress.done);
                }).ok());
    EXPECT_EQ(kept, 4u);
}

TEST_F(Bench, ResultsOfAnotherTruthDeviceOrSettingAreNotUsed) {
    const auto variants = swept("5");
    BenchSettings one = settings();
    one.run.frames = io::FrameRange{{1}};
    const std::pair<const char*, std::function<void(BenchSettings&)>> changes[] = {
        {"device", [](BenchSettings& s) { s.renderer = "another device"; }},
        {"version", [](BenchSettings& s) { s.run.version = "2"; }},
        {"repeats", [](BenchSettings& s) { s.repeats = 3; }},
        {"viewing distance", [](BenchSettings& s) { s.flip.pixels_per_degree = 40; }},
        {"elision", [](BenchSettings& s) { s.run.plan.rules_off = {kRuleUnusedStep}; }},
        {"truth", [&](BenchSettings&) { test::write_truth(folder_.path(), 1, 1, 0.25f); }}};
    for (const auto& [what, change] : changes) {
        done(variants, one);
        EXPECT_TRUE(done(variants, one).variants[0].resumed) << what;
        BenchSettings changed = one;
        change(changed);
        EXPECT_FALSE(done(variants, changed).variants[0].resumed) << what;
    }
    // The input is scored against the same ground truth.
    EXPECT_NEAR(*done(variants, one).input_metrics.at("mse").mean, 1.0 / 16, 1e-6);
}

TEST(BenchResults, BrokenFilesAreNoResults) {
    const test::TempFolder folder;
    const ResultStore store(folder.path(), "here", io::OutputFiles());
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
    const auto back = store.frame("abc", 7, "work");
    ASSERT_TRUE(back);
    EXPECT_EQ(back->metrics, result.metrics);
    EXPECT_EQ(back->elisions, result.elisions);
    EXPECT_FALSE(back->split);
    EXPECT_FALSE(store.frame("abc", 7, "other work"));
    EXPECT_FALSE(store.frame("abc", 8, "work"));
    EXPECT_FALSE(ResultStore(folder.path(), "there", io::OutputFiles()).frame("abc", 7, "work"));
    for (const char* text : {"", "{", "[]", "{\"key\": 3}"}) {
        test::write_text(folder.path("results/abc.7.json"), text);
        EXPECT_FALSE(store.frame("abc", 7, "work")) << text;
    }
}

}  // namespace
}  // namespace postchain::experiment
