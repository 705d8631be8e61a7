// run_tune on small sequences and the GL device.
#include "tools/measure/tune/tune.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>

#include "tests/measure/experiment/support.h"
#include "tests/support/status.h"
#include "tools/measure/experiment/converge.h"
#include "tools/measure/experiment/experiment_input.h"
#include "tools/measure/tune/tune_text.h"
#include "tools/sequence/source/frame_plan.h"
#include "tools/sequence/source/frame_source.h"

namespace postchain::tune {
namespace {

using ::testing::HasSubstr;

std::vector<Start> one(const std::string& pass) {
    std::vector<Start> starts;
    starts.push_back({"mine", test::parse("{postchain: 1, passes: [" + pass + "]}")});
    return starts;
}

Result<Tuning> run(std::vector<Start> starts, const std::vector<std::string>& fixed,
                   const TuneSettings& settings, const std::atomic<bool>* stop = nullptr) {
    return run_tune(std::move(starts), fixed, settings, test::executor(), {}, stop);
}

class Shot : public ::testing::Test {
  protected:
    void SetUp() override { test::write_sequence(folder_.path(), 2); }
    TuneSettings settings() {
        TuneSettings settings;
        static_cast<experiment::ExperimentSettings&>(settings) =
            test::settings_for(folder_.path(), folder_.path("tuned.yaml"));
        settings.repeats = 1;
        settings.truth.clear();
        return settings;
    }
    test::TempFolder folder_;
};

// The stated error is that of the chosen chain, measured again from the files.
TEST_F(Shot, WithoutATruthTheReferenceIsTheConvergedImage) {
    TuneSettings tuned = settings();
    tuned.error = 0.06;
    tuned.max_chains = 12;
    const Tuning tuning =
        test::must(run(one("motion_blur: {mode: guertin, samples: 33}"), {}, tuned));
    ASSERT_TRUE(tuning.chosen()) << outcome_text(tuning);
    EXPECT_FALSE(tuning.with_truth);
    EXPECT_THAT(tuning.reference,
                ::testing::AllOf(HasSubstr("no ground truth: the converged image of mine"),
                                 HasSubstr("samples 33 -> 401")));
    EXPECT_GT(tuning.search.candidates.size(), 1u);

    const Chain converging = test::parse("{postchain: 1, passes: [motion_blur: {mode: guertin}]}");
    const auto survey =
        test::must(experiment::survey_input(tuned.run, tuned.flip.tone_mapper, true));
    experiment::ExperimentInput input;
    input.files = test::must(io::find_frames(tuned.run.input, tuned.run.frames)).files;
    metrics::CompareSettings compare;
    compare.metrics = {"hdr_flip"};
    compare.exposures = survey.exposures;
    double sum = 0;
    for (int frame : {1, 2}) {
        const auto source = test::must(experiment::read_frame(
            input, tuned.run, frame, converging.required() | converging.optional()));
        const auto truth = test::must(experiment::converge(converging, source.description,
                                                           source.planes, {}, test::executor(), 2));
        const auto plan =
            test::must(sequence::plan_source_frame(tuning.chosen()->chain, source, {}));
        const auto image = test::must(test::executor().filter(plan, source.planes));
        const auto pair = test::must(metrics::pair_of(image.at(Role::color), truth.rgb));
        sum += *test::must(metrics::compare(pair, compare)).value("hdr_flip");
    }
    EXPECT_NEAR(*tuning.chosen()->measured.error, sum / 2, 1e-9);
    EXPECT_LE(sum / 2, 0.06);
}

// A frame without neighbors: chains that differ only in them do the same work, and are one point.
TEST_F(Shot, AKnobWithoutEffectIsMeasuredOnce) {
    TuneSettings tuned = settings();
    tuned.run.input = *io::InputSpec::parse(folder_.path("in.0001.exr"));
    tuned.budget = "100s";
    tuned.measure_frames = 1;
    const Tuning tuning = test::must(run(one("motion_blur: {samples: 9}"),
                                         {"motion_blur.samples", "motion_blur.starts"}, tuned));
    const auto& candidates = tuning.search.candidates;
    ASSERT_GE(candidates.size(), 2u);
    EXPECT_EQ(candidates[0].measured.error, candidates[1].measured.error);
    EXPECT_EQ(tuning.search.front().size(), 1u);
    EXPECT_THAT(tuning.notes, ::testing::Contains(HasSubstr("without the frame after")));
}

TEST_F(Shot, AgainstATruthTheOrderChanges) {
    test::write_truth(folder_.path(), 1, 2, 0.125f);
    TuneSettings tuned = settings();
    tuned.truth = folder_.path("truth.####.exr");
    tuned.budget = "100s";
    const Tuning tuning = test::must(run(one("motion_blur: {mode: guertin, samples: 5}, fxaa: {}"),
                                         {"motion_blur.samples"}, tuned));
    EXPECT_EQ(tuning.search.candidates.size(), 2u);
    EXPECT_THAT(tuned_chain_file(tuning),
                HasSubstr("\n# reference: ground truth " + tuned.truth + "\n"));
}

TEST_F(Shot, AStopAndSeveralChainsWithoutATruthAreErrors) {
    TuneSettings tuned = settings();
    tuned.budget = "1s";
    const std::atomic<bool> stop = true;
    EXPECT_EQ(run(one("motion_blur: {}"), {}, tuned, &stop).status().code(), StatusCode::canceled);
    auto starts = one("fxaa: {}");
    starts.push_back({"other", test::parse(test::kChainText)});
    EXPECT_EQ(run(std::move(starts), {}, tuned).status().code(), StatusCode::usage);
}

}  // namespace
}  // namespace postchain::tune
