// The search with an evaluator whose times and errors are formulas, against all combinations.
#include "tools/measure/tune/pareto_search.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "tests/measure/experiment/support.h"
#include "tools/measure/tune/tune.h"

namespace postchain::tune {
namespace {

using ::testing::ElementsAre;

Chain joint(int samples = 32, int starts = 4, const std::string& neighbors = "both",
            bool denoise = true, const std::string& after = "") {
    const std::string text = concat("{postchain: 1, passes: [{joint_blur: {samples: ", samples,
                                    ", starts: ", starts, ", neighbors: ", neighbors,
                                    ", denoise: ", denoise ? "true" : "false", "}}", after, "]}");
    return test::parse(text);
}

template <class T>
T value(const Chain& chain, const std::string& key) {
    for (const ChainLink& link : chain.links)
        if (const Parameter* row = link.type->parameters->find(key);
            row && link.type->name == "joint_blur")
            return std::get<T>(row->get(link.pass->parameters()));
    ADD_FAILURE() << key;
    return {};
}

// A frame: 5 ms, and for each sample 1 ms per visited start surface and neighbor; 20 ms of denoise.
// Error: noise of the samples, what few starts and no neighbors miss.
Measured formula(const Chain& chain) {
    const double samples = double(value<int64_t>(chain, "samples"));
    const double starts = double(value<int64_t>(chain, "starts"));
    const std::string neighbors = value<std::string>(chain, "neighbors");
    const double frames = neighbors == "both" ? 3 : neighbors == "before" ? 2 : 1;
    const bool denoise = value<bool>(chain, "denoise");
    Measured measured;
    measured.times.seconds =
        5e-3 + 1e-3 * samples * (1 + 0.2 * starts) * (0.5 + 0.5 * frames) + (denoise ? 0.02 : 0);
    measured.error = (denoise ? 0.12 : 0.3) / std::sqrt(samples) + 0.04 / starts + 0.03 / frames;
    if (chain.links.front().type->name == "fxaa") *measured.error += 0.01;
    return measured;
}

class Formulas : public ChainEvaluator {
  public:
    Result<Measured> measure(const Chain& chain) override {
        ++measured;
        return formula(chain);
    }
    Result<Times> time_again(const Chain& chain) override {
        ++again;
        Times times = formula(chain).times;
        times.repeats = 2;
        return times;
    }
    int measured = 0, again = 0;
};

std::vector<Chain> all_combinations() {
    std::vector<Chain> all;
    for (int samples : {4, 8, 16, 32, 64, 128})
        for (int starts : {1, 2, 4, 8})
            for (const char* neighbors : {"none", "before", "both"})
                for (bool denoise : {false, true})
                    all.push_back(joint(samples, starts, neighbors, denoise));
    return all;
}

// Texts of the chains on the front of all combinations, within the budget, the fastest first.
std::vector<std::string> true_front(double budget_s) {
    const auto all = all_combinations();
    std::map<double, std::string> front;
    for (const Chain& one : all) {
        const Measured here = formula(one);
        const bool beaten = std::any_of(all.begin(), all.end(), [&](const Chain& other) {
            const Measured there = formula(other);
            return there.times.seconds <= here.times.seconds && *there.error <= *here.error &&
                   (there.times.seconds < here.times.seconds || *there.error < *here.error);
        });
        if (!beaten && here.times.seconds <= budget_s) front[here.times.seconds] = knobs_text(one);
    }
    std::vector<std::string> texts;
    for (const auto& [seconds, text] : front) texts.push_back(text);
    return texts;
}

std::vector<Start> one_start(Chain chain) {
    std::vector<Start> starts;
    starts.push_back({"start", std::move(chain)});
    return starts;
}

const Steps kSteps = [](const Chain& chain) { return steps_from(chain, {}, false); };

ParetoSearch searched(const Goal& goal, ChainEvaluator& evaluator, Chain start = joint(),
                      int most = 1000) {
    auto search = tune::search_front(one_start(std::move(start)), kSteps, goal, most, evaluator);
    EXPECT_TRUE(search.ok()) << search.status().message();
    return std::move(*search);
}

std::string chosen_of(const ParetoSearch& search) {
    return search.chosen ? knobs_text(search.candidates[*search.chosen].chain) : "none";
}

TEST(TuneSearch, FindsTheFrontOfAllCombinationsWithinTheBudget) {
    for (const double budget : {0.03, 0.1, 0.3}) {
        SCOPED_TRACE(budget);
        Formulas formulas;
        const Goal goal = {.budget_s = budget, .error = {}};
        const std::vector<std::string> expected = true_front(budget);
        const ParetoSearch search = searched(goal, formulas);
        EXPECT_TRUE(search.complete);
        std::vector<std::string> within;
        for (const size_t i : search.front())
            if (search.candidates[i].measured.times.seconds <= budget)
                within.push_back(knobs_text(search.candidates[i].chain));
        EXPECT_EQ(within, expected);
        EXPECT_EQ(chosen_of(search), expected.back());
        EXPECT_LT(formulas.measured, 144);
        // The chain closest to the goal comes first: if the start is not far from it (0.14 s),
        // a short walk chooses the same chain.
        if (budget < 0.1) continue;
        EXPECT_EQ(chosen_of(searched(goal, formulas, joint(), TuneSettings().max_chains)),
                  expected.back());
    }
}

TEST(TuneSearch, FindsTheLeastTimeOfAllCombinationsWithinTheError) {
    for (const double limit : {0.12, 0.06, 0.035}) {
        std::optional<double> least;
        for (const Chain& chain : all_combinations())
            if (const Measured here = formula(chain); *here.error <= limit)
                least = std::min(least.value_or(1e9), here.times.seconds);
        for (const int most : {1000, TuneSettings().max_chains}) {
            Formulas formulas;
            const ParetoSearch search =
                searched({.budget_s = {}, .error = limit}, formulas, joint(), most);
            ASSERT_TRUE(search.chosen && least) << limit;
            EXPECT_DOUBLE_EQ(search.candidates[*search.chosen].measured.times.seconds, *least)
                << limit << " " << most;
        }
    }
}

// From the most expensive chain down, and without a look at what lies far beyond the budget.
TEST(TuneSearch, AStartBeyondTheBudgetLeadsToCheaperChains) {
    Formulas formulas;
    EXPECT_EQ(
        chosen_of(searched({.budget_s = 0.05, .error = {}}, formulas, joint(128, 8, "both", true))),
        true_front(0.05).back());
}

TEST(TuneSearch, AGoalThatNoChainMeetsNamesTheClosest) {
    Formulas formulas;
    ParetoSearch search = searched({.budget_s = 1e-3, .error = {}}, formulas);
    EXPECT_FALSE(search.chosen);
    EXPECT_EQ(knobs_text(search.candidates[*search.fastest()].chain),
              "joint_blur samples 4 starts 1 neighbors none denoise false");
    EXPECT_EQ(formulas.again, 0);
    search = searched({.budget_s = {}, .error = 1e-3}, formulas);
    EXPECT_FALSE(search.chosen);
    EXPECT_EQ(knobs_text(search.candidates[*search.closest()].chain),
              "joint_blur samples 128 starts 8 neighbors both denoise true");
}

TEST(TuneSearch, EndsAfterANumberOfChainsAndSaysSo) {
    for (int most : {1, 7}) {
        Formulas formulas;
        const ParetoSearch search =
            searched({.budget_s = 0.1, .error = {}}, formulas, joint(4, 1, "none"), most);
        EXPECT_EQ(formulas.measured, most);
        EXPECT_FALSE(search.complete);
    }
}

TEST(TuneSearch, ChangesTheOrder) {
    Formulas formulas;
    const Steps steps = [](const Chain& chain) {
        return steps_from(chain,
                          {"joint_blur.samples", "joint_blur.starts", "joint_blur.neighbors",
                           "joint_blur.denoise"},
                          true);
    };
    Chain start = joint(32, 4, "both", true, ", fxaa");
    std::swap(start.links[0], start.links[1]);
    auto search = tune::search_front(one_start(std::move(start)), steps,
                                     {.budget_s = 1, .error = {}}, 10, formulas);
    ASSERT_TRUE(search.ok());
    EXPECT_EQ(search->candidates.size(), 2u);
    EXPECT_THAT(search->candidates[*search->chosen].chain.types(),
                ElementsAre("joint_blur", "fxaa"));
}

// One chain's first time is by luck a hundredth of the truth.
class LuckyOnce final : public Formulas {
  public:
    Result<Measured> measure(const Chain& chain) override {
        auto found = Formulas::measure(chain);
        if (value<int64_t>(chain, "samples") == 32) found->times.seconds *= 0.01;
        return found;
    }
};

TEST(TuneSearch, ATimeThatWasLuckIsNotChosen) {
    LuckyOnce lucky;
    const ParetoSearch search = searched({.budget_s = 0.1, .error = {}}, lucky);
    const Candidate& chosen = search.candidates[*search.chosen];
    EXPECT_TRUE(chosen.confirmed);
    EXPECT_EQ(chosen.measured.times.repeats, 2);
    EXPECT_LE(formula(chosen.chain).times.seconds, 0.1);
    EXPECT_GT(lucky.again, 1);
}

// Chains that cannot be told apart: the earlier one is on the front.
class Same final : public Formulas {
  public:
    Result<Measured> measure(const Chain&) override { return formula(joint()); }
};

TEST(TuneSearch, OfEqualChainsTheFirstStays) {
    Same same;
    const ParetoSearch search = searched({.budget_s = 1, .error = {}}, same);
    EXPECT_THAT(search.front(), ElementsAre(0u));
    EXPECT_EQ(search.chosen, 0u);
}

// Ends with this status after a number of chains.
class Ending final : public Formulas {
  public:
    Ending(Status end, int after) : end_(std::move(end)), after_(after) {}
    Result<Measured> measure(const Chain& chain) override {
        if (measured >= after_) return end_;
        return Formulas::measure(chain);
    }

  private:
    Status end_;
    int after_;
};

Result<ParetoSearch> search_until(Status end, int after, const Goal& goal) {
    Ending evaluator(std::move(end), after);
    return tune::search_front(one_start(joint()), kSteps, goal, 99, evaluator);
}

TEST(TuneSearch, AStopKeepsTheBestSoFar) {
    const auto found = [](const Goal& goal, int after) {
        return search_until(Status(StatusCode::canceled, "stopped"), after, goal);
    };
    Formulas all;
    const ParetoSearch whole = searched({.budget_s = 1, .error = {}}, all);
    EXPECT_FALSE(whole.stopped);
    const auto part = found({.budget_s = 1, .error = {}}, 5);
    ASSERT_TRUE(part.ok()) << part.status().message();
    EXPECT_TRUE(part->stopped);
    EXPECT_FALSE(part->complete);
    ASSERT_EQ(part->candidates.size(), 5u);
    for (size_t i = 0; i < 5; ++i) {
        EXPECT_EQ(part->candidates[i].chain.text(), whole.candidates[i].chain.text());
        EXPECT_GE(*part->candidates[i].measured.error,
                  *part->candidates[*part->chosen].measured.error);
    }
    // No chain meets this goal: the closest.
    const auto unmet = found({.budget_s = {}, .error = 1e-9}, 5);
    ASSERT_TRUE(unmet.ok());
    EXPECT_EQ(unmet->chosen, unmet->closest());
    EXPECT_EQ(found({.budget_s = 1, .error = {}}, 0).status().code(), StatusCode::canceled);
}

TEST(TuneSearch, AFailureEndsIt) {
    const auto search =
        search_until(Status(StatusCode::gl, "the device is gone"), 3, {.budget_s = 1, .error = {}});
    EXPECT_EQ(search.status().message(), "the device is gone");
}

}  // namespace
}  // namespace postchain::tune
