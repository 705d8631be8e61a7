#include "tools/measure/tune/knobs.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/measure/experiment/support.h"
#include "tests/support/transcript.h"
#include "tools/measure/experiment/settings.h"
#include "tools/measure/study/study.h"
#include "tools/measure/tune/tune.h"

namespace postchain::tune {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

Chain chain_of(const std::string& passes) {
    return test::parse("{postchain: 1, passes: [" + passes + "]}");
}

// "<" for a cheaper step, ">" for a more expensive one, "=" for another order.
std::vector<std::string> steps(const Chain& chain, const std::vector<std::string>& fixed = {},
                               bool order = false) {
    std::vector<std::string> found;
    for (const Step& step : steps_from(chain, fixed, order))
        found.push_back(std::string(1, "<=>"[int(step.cost)]) + " " + knobs_text(step.chain));
    return found;
}

TEST(Knobs, AStepChangesOneValueByOne) {
    EXPECT_THAT(steps(chain_of("joint_blur: {samples: 16, starts: 1, neighbors: before}")),
                ElementsAre("< joint_blur samples 8 starts 1 neighbors before denoise true",
                            "> joint_blur samples 32 starts 1 neighbors before denoise true",
                            "> joint_blur samples 16 starts 2 neighbors before denoise true",
                            "< joint_blur samples 16 starts 1 neighbors none denoise true",
                            "> joint_blur samples 16 starts 1 neighbors both denoise true",
                            "< joint_blur samples 16 starts 1 neighbors before denoise false"));
}

// Values of a user's chain need not be powers of two; samples of motion blur are odd.
TEST(Knobs, ValuesBetweenTheStepsAndAtTheirEnds) {
    EXPECT_THAT(steps(chain_of("joint_blur: {samples: 48}"),
                      {"joint_blur.starts", "joint_blur.neighbors", "joint_blur.denoise"}),
                ElementsAre("< joint_blur samples 32 starts 4 neighbors both denoise true",
                            "> joint_blur samples 64 starts 4 neighbors both denoise true"));
    const std::vector<std::string> others = {"motion_blur.starts", "motion_blur.neighbors"};
    EXPECT_THAT(steps(chain_of("motion_blur: {samples: 25}"), others),
                ElementsAre("< motion_blur samples 17 starts 4 neighbors both",
                            "> motion_blur samples 33 starts 4 neighbors both"));
    EXPECT_THAT(steps(chain_of("motion_blur: {samples: 5}"), others),
                ElementsAre("> motion_blur samples 9 starts 4 neighbors both"));
    EXPECT_THAT(steps(chain_of("motion_blur: {samples: 1}"), others),
                ElementsAre("> motion_blur samples 5 starts 4 neighbors both"));
}

TEST(Knobs, RowsThatAreNotReadAreNone) {
    EXPECT_THAT(steps(chain_of("motion_blur: {mode: guertin, samples: 33}")),
                ElementsAre("< motion_blur samples 17"));
    EXPECT_THAT(steps(chain_of("fxaa")), IsEmpty());
    EXPECT_EQ(knobs_text(chain_of("depth_of_field: {method: gilham}, fxaa: {}")),
              "depth_of_field, fxaa");
}

TEST(Knobs, NeighboringPassesChangePlaces) {
    const Chain chain = chain_of(
        "motion_blur: {mode: guertin, samples: 33}, fxaa: {}, "
        "depth_of_field: {method: gilham}");
    EXPECT_THAT(steps(chain, {"motion_blur.samples"}, true),
                ElementsAre("= fxaa, motion_blur samples 33, depth_of_field",
                            "= motion_blur samples 33, depth_of_field, fxaa"));
}

TEST(Knobs, ValuesThatAreSetStay) {
    const Chain chain = chain_of("joint_blur: {}, fxaa: {}");
    EXPECT_THAT(fixed_knobs(chain, {"joint_blur.samples=16", "passes[0].neighbors=none",
                                    "camera.f_stop=2", "fxaa.preset=39"}),
                ElementsAre("joint_blur.samples", "joint_blur.neighbors"));
}

TEST(Knobs, TheConvergedChainTakesNoShortcut) {
    EXPECT_EQ(knobs_text(without_shortcuts(
                  chain_of("joint_blur: {samples: 8, starts: 2, neighbors: none}, fxaa: {}"))),
              "joint_blur samples 128 starts 8 neighbors both denoise false, fxaa");
}

// Settings of the commands that measure.

using ::testing::HasSubstr;

Result<Goal> goal(const std::string& budget, std::optional<double> error = {}) {
    TuneSettings settings;
    settings.budget = budget;
    settings.error = error;
    return goal_of(settings);
}

TEST(Settings, EveryMember) {
    const test::Transcript whole(POSTCHAIN_SOURCE_DIR "/tests/measure/tune/expected");
    for (const auto& [name, table] : {std::pair("ab", &experiment::ab_parameters()),
                                      {"bench", &experiment::bench_parameters()},
                                      {"study", &study::study_parameters()},
                                      {"tune", &tune_parameters()}})
        for (const Parameter& row : table->rows()) {
            std::string line = concat(name, " ", row.key, ": ", name_of(row.type), ", ",
                                      text_of(row.default_value), " in ", row.domain(),
                                      row.optional ? ", optional" : "", ", group '", row.group,
                                      "', unit '", row.unit, "': ", row.help);
            if (!row.unset_means.empty()) line += "; unset: " + row.unset_means;
            test::Transcript::say(line);
        }
}

TEST(TuneGoal, ABudgetHasAUnit) {
    for (const auto& [text, seconds] :
         {std::pair{"0.2", 0.2}, {"0.2s", 0.2}, {"200ms", 0.2}, {"3s", 3.0}, {"1e-3s", 1e-3}}) {
        const auto made = goal(text);
        ASSERT_TRUE(made.ok()) << text;
        EXPECT_DOUBLE_EQ(*made->budget_s, seconds) << text;
        EXPECT_FALSE(made->error);
    }
}

TEST(TuneGoal, OtherBudgetsAreRefused) {
    for (const char* text :
         {"0", "-1s", "0ms", "nan", "inf", "fast", "2m", "1us", "0.2 s", "s", "1e999"}) {
        const auto made = goal(text);
        EXPECT_EQ(made.status().code(), StatusCode::usage) << text;
        EXPECT_THAT(made.status().message(), HasSubstr(concat("{budget}: '"_keyed, text, "'")));
    }
}

TEST(TuneGoal, ExactlyOneIsGiven) {
    EXPECT_DOUBLE_EQ(*goal("", 0.07)->error, 0.07);
    for (const auto& [made, said] : {std::pair{goal("", 0.0), "{error}"_keyed},
                                     {goal("1s", 0.07), "give one of the two"},
                                     {goal(""), "give a time per frame"}}) {
        EXPECT_EQ(made.status().code(), StatusCode::usage);
        EXPECT_THAT(made.status().message(), HasSubstr(said));
    }
}

}  // namespace
}  // namespace postchain::tune
