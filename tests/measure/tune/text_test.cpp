#include "tools/measure/tune/tune_text.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "config/chain_file.h"
#include "passes/registry.h"
#include "tests/measure/experiment/support.h"
#include "tests/support/filled_json.h"
#include "tests/support/text_file.h"

namespace postchain::tune {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

Candidate candidate(int samples, double seconds, std::optional<double> error,
                    const std::string& doubt = "") {
    return {test::parse(concat("{postchain: 1, passes: [{motion_blur: {mode: guertin, samples: ",
                               samples, "}}]}")),
            "",
            {{seconds, 0.01, 3, doubt}, error}};
}

Tuning tuning(const Goal& goal) {
    Tuning made;
    made.goal = goal;
    made.version = "1.2.3";
    made.input = "a\nb.exr";
    made.frames = "1-3 (64x40)";
    made.reference = "ground truth t.####.exr";
    made.with_truth = true;
    made.device = "llvmpipe, fp32, 2 threads";
    made.timing = "wall clock around glFinish";
    made.search.complete = true;
    made.search.candidates.push_back(candidate(9, 0.1, 0.08));
    made.search.candidates.push_back(candidate(5, 0.05, 0.1, "others were busy"));
    made.search.candidates.push_back(candidate(17, 0.2, 0.09));  // beaten
    made.search.candidates.push_back(candidate(33, 0.9, std::nullopt));
    return made;
}

TEST(TuneText, TheFileHasConditionsFrontAndChain) {
    Tuning made = tuning({.budget_s = 0.102, .error = {}});
    made.search.chosen = 0;
    made.search.candidates[0].name = "fast";
    made.search.candidates[0].measured.times.repeats = 6;
    const std::string file = tuned_chain_file(made);
    EXPECT_EQ(file.substr(0, file.find("\npostchain: 1")),
              R"(# postchain tune 1.2.3, --budget 0.102s: the least error within this time per frame
# input: a\nb.exr, frames 1-3 (64x40)
# reference: ground truth t.####.exr
# device: llvmpipe, fp32, 2 threads
# time: wall clock around glFinish, of the passes without reading and writing; per frame the median of 3 repetitions (chosen chain: 6, timed again); spread: quartiles
# Chains that no other of the 4 measured beats in both time and error (*: this file):
#    s/frame   spread hdr_flip  chain
#  ~    0.05     0.01      0.1  motion_blur samples 5
# *      0.1     0.01     0.08  motion_blur samples 9 (start: fast)
# ~: untrustworthy time (1 chain): others were busy
# the spread of the chosen chain's time reaches beyond the budget)");
    const auto parsed = parse_chain(file, "tuned", builtin_passes());
    EXPECT_EQ(parsed.chain.hash(), made.chosen()->chain.hash());
}

TEST(TuneText, TheFileOfAStoppedWalkHasItsChains) {
    Tuning made = tuning({.budget_s = 1, .error = {}});
    EXPECT_FALSE(stopped_walk_of("")) << "no file";
    made.search.chosen = 0;
    EXPECT_FALSE(stopped_walk_of(tuned_chain_file(made)));
    made.key = "abc";
    made.search.stopped = true;
    made.search.candidates[1].confirmed = true;
    const std::string file = tuned_chain_file(made);
    EXPECT_THAT(file,
                HasSubstr("# the walk was stopped after 4 chains; the same command goes on\n"));
    const auto walk = stopped_walk_of(file);
    ASSERT_TRUE(walk);
    EXPECT_EQ(walk->key, "abc");
    ASSERT_EQ(walk->by_hash.size(), 4u);
    for (const Candidate& one : made.search.candidates) {
        const auto& point = walk->by_hash.at(one.chain.hash());
        EXPECT_EQ(point.measured.error, one.measured.error);
        const Times &read = point.measured.times, &written = one.measured.times;
        EXPECT_EQ(std::tie(read.seconds, read.spread_s, read.repeats, read.doubt),
                  std::tie(written.seconds, written.spread_s, written.repeats, written.doubt));
        EXPECT_EQ(point.confirmed, one.confirmed);
    }
    // An edited file is not replaced.
    std::string edited = file;
    edited.replace(edited.find("samples: 9"), 10, "samples: 5");
    for (const std::string& other : {edited, file + "# mine\n", file.substr(0, file.size() - 20)})
        EXPECT_FALSE(stopped_walk_of(other));
    // Whole, but without a key, and with points that are none.
    const auto ended = [](const std::string& text) {
        return text + "# unchanged " + hex_of(hash_text(text)) + "\n";
    };
    EXPECT_TRUE(stopped_walk_of(ended("# walk abc\n")));
    for (const char* none :
         {"# walk \n", "# walk abc\n# measured {\n", "# walk abc\n# measured 3\n"})
        EXPECT_FALSE(stopped_walk_of(ended(none))) << none;
    // A time that was confirmed before the stop; a goal that no chain meets.
    EXPECT_THAT(file, testing::Not(HasSubstr("timed again")));
    made.search.candidates[0].confirmed = true;
    made.goal.budget_s = 0.01;
    EXPECT_THAT(tuned_chain_file(made),
                AllOf(HasSubstr("(chosen chain: 3, timed again)"),
                      HasSubstr("the same command goes on; no chain meets the goal yet\n")));
}

TEST(TuneText, AnUnmetGoalHasARemedy) {
    EXPECT_THAT(
        outcome_text(tuning({.budget_s = 0.01, .error = {}})),
        AllOf(HasSubstr("{budget=0.01s}: the fastest of 4 chains measured takes 0.05 s"_keyed),
              HasSubstr("motion_blur samples 5; raise the budget")));
    EXPECT_THAT(
        outcome_text(tuning({.budget_s = {}, .error = 0.01})),
        AllOf(HasSubstr("{error=0.01}: the closest of 4 chains measured has HDR-FLIP 0.08"_keyed),
              HasSubstr("motion_blur samples 9; allow a larger error")));
}

TEST(TuneText, AWalkThatWasCutSaysSo) {
    Tuning made = tuning({.budget_s = 1, .error = {}});
    made.search.complete = false;
    made.notes = {"a note"};
    EXPECT_THAT(doubts_of(made),
                ElementsAre("a note",
                            "the walk ended after 4 chains ({max_chains}); more may lie on the "
                            "front"_keyed,
                            HasSubstr("untrustworthy")));
}

TEST(TuneText, JsonHasEveryMemberUnderItsName) {
    Tuning made = tuning({.budget_s = 0.1, .error = {}});
    made.search.chosen = 0;
    made.search.candidates[0].name = "fast";
    made.search.candidates[1].measured.times = {0.05, 0.0125, 7, "others were busy"};
    made.notes = {"a note"};
    Tuning other = tuning({.budget_s = {}, .error = 0.01});
    other.with_truth = false;
    other.search.candidates.resize(1);
    std::string text;
    for (const Tuning* one : {&made, &other}) {
        auto json = tuning_json(*one);
        for (size_t i = 0; i < json["points"].size(); ++i) {
            auto& hash = json["points"][i]["chain_hash"];
            EXPECT_EQ(hash, hex_of(one->search.candidates[i].chain.hash()));
            hash = "16 digits";  // others with each new parameter
        }
        text += test::filled_json(json) + "\n";
    }
    test::expect_text_of(POSTCHAIN_SOURCE_DIR "/tests/measure/tune/expected/tune.json", text);
}

}  // namespace
}  // namespace postchain::tune
