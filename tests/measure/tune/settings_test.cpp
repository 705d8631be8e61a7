// Settings of the commands that measure.
#include "tools/measure/tune/tune.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/transcript.h"
#include "tools/measure/experiment/settings.h"
#include "tools/measure/study/study.h"

namespace postchain::tune {
namespace {

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
