// Leaving out changes no bit: random chains on random frames. Six shapes of chain, a test each,
// begin with each type of pass. Every third of their cases runs, because most of the time goes into
// compiling programs.
//
//   POSTCHAIN_ELISION_EVERY=1        all cases of the six shapes
//   POSTCHAIN_ELISION_SEED=123       this one case, with its text
#include <gtest/gtest.h>

#include <cstdlib>
#include <map>

#include "chain/egl/context.h"
#include "passes/registry.h"
#include "tests/elision/random_case.h"
#include "tests/elision/support.h"

namespace postchain::test {
namespace {

constexpr uint64_t kShapes = 6;
constexpr uint64_t kEvery = 3;

std::optional<uint64_t> environment(const char* name) {
    const char* text = std::getenv(name);
    if (!text || !*text) return std::nullopt;
    return std::strtoull(text, nullptr, 10);
}

struct Run {
    std::string name;
    uint64_t first, end, step;
};

std::vector<Run> runs() {
    if (const auto seed = environment("POSTCHAIN_ELISION_SEED"))
        return {{concat("Seed", *seed), *seed, *seed + 1, 1}};
    const uint64_t step = environment("POSTCHAIN_ELISION_EVERY").value_or(kEvery);
    std::vector<Run> shapes;
    for (uint64_t k = 0; k < kShapes; ++k)
        shapes.push_back({concat("Shape", k), k * kCasesOfAShape, (k + 1) * kCasesOfAShape, step});
    return shapes;
}

class RandomChains : public ::testing::TestWithParam<Run> {
  protected:
    // What all six shapes do together.
    static void TearDownTestSuite() {
        EXPECT_GT(run_, 4 * refused_);
        if (runs_ < kShapes) return;
        // Every rule had something to do.
        for (const auto& rule : elision_rules(every_pass())) {
            // These change bits.
            if (!rule.on_by_default || rule.name == kRuleCameraCut) continue;
            EXPECT_GT(acted_[rule.name], 0) << rule.name;
        }
        for (const auto& [item, cases] : acted_on_blocks_) EXPECT_GT(cases, 0) << item;
        EXPECT_GE(acted_on_blocks_.size(), 7u);
    }

    void SetUp() override {
        auto made = egl::Context::create();
        ASSERT_TRUE(made.ok()) << made.status().message();
        context_ = std::move(*made);
        executor_ = std::make_unique<Executor>(context_->device());
    }

    FramePlanes run(const Plan& plan, const FramePlanes& planes) {
        auto result = executor_->filter(plan, planes);
        EXPECT_TRUE(result.ok()) << result.status().message();
        return result.ok() ? std::move(*result) : FramePlanes();
    }

    // A hint exists only if a blur that is not elided made it.
    void compare(const FramePlanes& complete, const FramePlanes& elided) {
        EXPECT_EQ(elided.count(Role::color), complete.count(Role::color));
        for (const auto& [role, plane] : elided) {
            ASSERT_TRUE(complete.count(role)) << name_of(role);
            EXPECT_EQ(first_difference(complete.at(role), plane), "") << name_of(role);
        }
    }

    void check(uint64_t seed) {
        const RandomCase one = random_case(seed);
        if (environment("POSTCHAIN_ELISION_SEED")) std::printf("%s\n", one.text.c_str());
        SCOPED_TRACE(
            concat("seed ", seed, ", again with POSTCHAIN_ELISION_SEED=", seed, "\n", one.text));
        PlanOptions all = no_rule(one.elided.precision);
        all.outputs = one.elided.outputs;
        PlanOptions some = one.elided;
        all.device = some.device = executor_->device_class();
        const auto complete = make_plan(one.chain, one.frame, all);
        const auto elided = make_plan(one.chain, one.frame, some);
        if (!complete.ok()) {  // a Gaussian too wide, a focus nearer than the focal length
            EXPECT_FALSE(elided.ok());
            ++refused_;
            return;
        }
        ASSERT_TRUE(elided.ok()) << elided.status().message();
        const FramePlanes whole = run(*complete, one.planes);
        // No right values are left where the elided run computes nothing.
        run(*complete, other_frame(one.planes));
        const FramePlanes first = run(*elided, one.planes);
        count(*elided);
        compare(whole, first);
        compare(whole, run(*elided, one.planes));  // lists are in another order
        ++run_;
    }

    // The effect of a rule: for blocks, only if the device found some.
    void count(const Plan& plan) {
        for (const auto& elision : plan.elisions) {
            const bool blocks = elision.kind == ElisionKind::blocks;
            if (blocks) acted_on_blocks_[elision.item];  // 0 where it never found one
            if (!found_in(elision, plan, executor_->work_done())) continue;
            ++acted_[elision.rule];
            if (blocks) ++acted_on_blocks_[elision.item];
        }
    }

    std::unique_ptr<egl::Context> context_;
    std::unique_ptr<Executor> executor_;
    static inline std::map<std::string, int> acted_;            // entries of cases, by rule
    static inline std::map<std::string, int> acted_on_blocks_;  // by what was elided in blocks
    static inline int run_ = 0, refused_ = 0;
    static inline uint64_t runs_ = 0;
};

TEST_P(RandomChains, LeaveOutNoBit) {
    for (uint64_t seed = GetParam().first; seed < GetParam().end && !HasFailure();
         seed += GetParam().step)
        check(seed);
    ++runs_;
}

INSTANTIATE_TEST_SUITE_P(Of, RandomChains, ::testing::ValuesIn(runs()),
                         [](const auto& one) { return one.param.name; });

}  // namespace
}  // namespace postchain::test
