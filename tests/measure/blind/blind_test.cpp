// Blind comparisons: what a page shows, its key, and what follows from choices.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <set>

#include "tests/support/status.h"
#include "tools/measure/blind/comparison.h"
#include "tools/sequence/image/png.h"

namespace postchain::blind {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

const std::vector<std::string> kSides = {"plain", "streaks", "circles"};
const std::vector<int> kFrames = {1, 2, 3, 4};

std::vector<Picture> images(const std::string& salt = "") {
    std::vector<Picture> made;
    for (size_t side = 0; side <= kSides.size(); ++side)
        for (const int frame : kFrames)
            made.push_back({frame, side, concat("png ", frame, " of ", side, salt)});
    return made;
}

Comparison comparison(uint64_t seed = 1, const std::string& salt = "") {
    return make_comparison(kSides, kFrames, seed, images(salt));
}

TEST(BlindComparison, HasEveryPairOfEveryFrameOnceInARandomOrder) {
    const Comparison made = comparison();
    std::set<std::tuple<int, size_t, size_t>> pairs;
    std::set<bool> is_in_order;
    std::vector<int> frames;
    for (const Trial& trial : made.trials) {
        const auto [a, b] = std::minmax(trial.left, trial.right);
        EXPECT_LT(a, b);
        EXPECT_TRUE(pairs.emplace(trial.frame, a, b).second);
        is_in_order.insert(trial.left < trial.right);
        frames.push_back(trial.frame);
    }
    EXPECT_EQ(pairs.size(), 12u);
    EXPECT_EQ(is_in_order.size(), 2u);
    EXPECT_FALSE(std::is_sorted(frames.begin(), frames.end()));
    // The seed decides, and nothing else; other images of the same names are another comparison.
    EXPECT_EQ(key_text(comparison()), key_text(made));
    const auto first = [](const Comparison& of) {
        return std::tuple{of.trials[0].frame, of.trials[0].left, of.trials[0].right};
    };
    EXPECT_NE(first(comparison(2)), first(made));
    EXPECT_NE(comparison(2).id, made.id);
    EXPECT_NE(comparison(1, "!").id, made.id);
}

TEST(BlindComparison, ItsKeyIsReadBackUnlessItWasChanged) {
    const Comparison made = comparison();
    std::string key = key_text(made);
    const Comparison back = test::must(comparison_from(key, "key.json"));
    EXPECT_EQ(key_text(back), key);
    EXPECT_EQ(back.sides, kSides);
    key.replace(key.find("\"frame\": 1,"), 11, "\"frame\": 2,");
    const auto changed = comparison_from(key, "key.json");
    EXPECT_EQ(changed.status().code(), StatusCode::input);
    EXPECT_THAT(test::error_of(changed), HasSubstr("was changed"));
}

// Each image once, numbered by first use: neither names nor numbers say which side it is of.
TEST(BlindPage, ShowsTheTrialsWithoutNames) {
    const Comparison made = comparison();
    const std::string page = page_of(made, images());
    for (const auto& side : kSides) EXPECT_EQ(page.find('"' + side), std::string::npos) << side;
    const std::string start = "id=\"data\">";
    const size_t from = page.find(start) + start.size();
    const auto data = nlohmann::json::parse(page.substr(from, page.find("</script>", from) - from));
    EXPECT_EQ(data["comparison"], made.id);
    ASSERT_EQ(data["trials"].size(), made.trials.size());
    std::set<size_t> seen;
    for (size_t i = 0; i < made.trials.size(); ++i) {
        const Trial& trial = made.trials[i];
        for (const auto& [key, side] :
             {std::pair{"left", trial.left}, {"right", trial.right}, {"truth", kSides.size()}}) {
            const size_t index = data["trials"][i][key].get<size_t>();
            if (seen.insert(index).second) {
                EXPECT_EQ(index, seen.size() - 1);
            }
            EXPECT_EQ(data["images"].at(index),
                      io::base64_of(concat("png ", trial.frame, " of ", side)));
        }
    }
    EXPECT_EQ(data["images"].size(), 16u);
}

std::string csv_of(const std::vector<std::string>& rows) {
    std::string text = "comparison,observer,trial,choice,seconds\n";
    for (const auto& row : rows) text += row + "\n";
    return text;
}

// Three observers prefer streaks to everything; the second sees no difference to circles.
TEST(BlindChoices, AreCountedForTheTrueSides) {
    const Comparison made = comparison();
    std::vector<Choice> choices;
    for (int observer = 0; observer < 3; ++observer) {
        std::vector<std::string> rows;
        for (size_t i = 0; i < made.trials.size(); ++i) {
            const Trial& trial = made.trials[i];
            const bool circles = trial.left == 2 || trial.right == 2;
            const char* choice = trial.left == 1 ? "A" : trial.right == 1 ? "B" : "none";
            if (observer == 1 && circles) choice = "none";
            rows.push_back(
                concat(made.id, ",observer ", observer, ",", i + 1, ",", choice, ",1.5"));
        }
        ASSERT_EQ(test::error_of(read_choices(csv_of(rows), "c.csv", made, choices)), "");
    }
    const auto results = results_of(made, choices);
    ASSERT_EQ(results.size(), 3u);
    const PairCounts &plain = results[0], &neither = results[1], &circles = results[2];
    const auto counts = [](const PairCounts& one) {
        return std::vector{int(one.a), int(one.b), one.for_a, one.for_b, one.for_none};
    };
    EXPECT_THAT(counts(plain), ElementsAre(0, 1, 0, 12, 0));
    EXPECT_THAT(counts(neither), ElementsAre(0, 2, 0, 0, 12));
    EXPECT_THAT(counts(circles), ElementsAre(1, 2, 8, 0, 4));
    // All of 12: the share at which that has a probability of 2.5 %.
    EXPECT_NEAR(plain.share_b->low, std::pow(0.025, 1.0 / 12), 1e-9);
    EXPECT_EQ(plain.share_b->high, 1);
    EXPECT_FALSE(neither.share_b);
    // Three questions: the smallest probability times 3, the next times 2.
    EXPECT_NEAR(plain.probability, 2 / std::exp2(12), 1e-12);
    EXPECT_NEAR(plain.corrected, 6 / std::exp2(12), 1e-12);
    EXPECT_NEAR(circles.corrected, 4 / std::exp2(8), 1e-12);
    EXPECT_EQ(neither.corrected, 1);
    EXPECT_EQ(words_of(made, plain),
              "streaks against plain: 12 to 0, no difference 0 times; preferred in 100 % (74 to "
              "100 %), p 0.001465");
    EXPECT_EQ(results_json(made, results, 3)["pairs"][0]["for_b"], 12);
}

TEST(BlindChoices, FaultsAreNamedWithFileAndLine) {
    const Comparison made = comparison();
    const std::string id = made.id;
    const std::pair<std::string, const char*> rows[] = {
        {csv_of({std::string(16, '0') + ",x,1,A,1"}),
         "c.csv:2: belongs to comparison 0000000000000000"},
        {csv_of({id + ",x,1,A,1", id + ",x,1,B,1"}), "c.csv:3: observer 'x' has answered trial 1"},
        {csv_of({id + ",x,13,A,1"}), "c.csv:2: trial 13 is not in 1..12"},
        {csv_of({id + ",x,0,A,1"}), "c.csv:2: trial 0"},
        {csv_of({id + ",x,1,C,1"}), "c.csv:2: choice C"},
        {csv_of({id + ",,1,A,1"}), "c.csv:2: names no observer"},
        {csv_of({id + ",x,1,A"}), "c.csv:2: has 4 fields"},
        {"a,b\n", "c.csv:1: the first line"},
        {"", "c.csv:1: the first line"}};
    for (const auto& [csv, said] : rows) {
        std::vector<Choice> choices;
        const Status status = read_choices(csv, "c.csv", made, choices);
        EXPECT_EQ(status.code(), StatusCode::input) << csv;
        EXPECT_THAT(status.message(), HasSubstr(said));
    }
    // As a spreadsheet saves it.
    std::vector<Choice> choices;
    EXPECT_EQ(test::error_of(read_choices("\xef\xbb\xbf"
                                          "comparison,observer,trial,choice,seconds\r\n" +
                                              id + ",x,1,A,1\r\n",
                                          "c.csv", made, choices)),
              "");
    EXPECT_EQ(choices.size(), 1u);
}

}  // namespace
}  // namespace postchain::blind
