// The plan gives the reason why the pass is left out; a hint keeps it. (That no bit changes:
// tests/elision.)
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <bit>
#include <cmath>

#include "tests/depth_of_field/support.h"
#include "tests/support/status.h"

namespace postchain::test {
namespace {

// R = 32 (1/4 - w) = 0.3125 px.
FramePlanes focused_planes() {
    return flat_planes(noise_image(33, 21, 4, 13), 0.240234375f);
}

Plan plan_of(const Chain& chain, const FramePlanes& planes, const PlanOptions& options = {}) {
    return must(make_plan(chain, describe_round(planes), options));
}

// coc, four that sort blocks, downsample, two blurs, three composites.
constexpr size_t kSteps = 10;

TEST(elision, tells_the_fact_and_what_is_saved) {
    FramePlanes planes = focused_planes();
    const Chain chain = chain_of("depth_of_field", {{"method", "gilham"}});
    const auto expect_elided = [&](const Chain& given, const char* rule, const char* fact) {
        const Plan plan = plan_of(given, planes);
        ASSERT_FALSE(plan.elisions.empty());
        EXPECT_TRUE(plan.steps.empty());
        EXPECT_EQ(plan.elisions[0].kind, ElisionKind::pass);
        EXPECT_EQ(plan.elisions[0].rule, rule);
        EXPECT_THAT(text_of(plan.elisions[0].fact), testing::MatchesRegex(fact));
        EXPECT_EQ(plan.elisions[0].saving.dispatches, int(kSteps));  // cost of the pass
        EXPECT_GT(plan.elisions[0].saving.bytes, 0u);
    };
    expect_elided(chain, kRuleFacts,
                  "largest circle-of-confusion radius 0\\.31[0-9]* px <= 0\\.5 px");
    EXPECT_EQ(plan_of(chain, planes, {.rules_off = {kRuleFacts}}).steps.size(), kSteps);
    planes[Role::inverse_depth].at(7, 7) = 0.2f;  // R = 1.6
    EXPECT_EQ(plan_of(chain, planes).steps.size(), kSteps) << "one pixel is blurred";
    expect_elided(chain_of("depth_of_field", {{"method", "gilham"}, {"max_radius_px", 0.5}}),
                  kRuleConfiguration,
                  "largest circle-of-confusion radius at any depth .* px <= 0\\.5 px");
}

// The decision is made in double precision, while the GPU works in fp32. Inverse depths around the
// one with a radius of 0.5 px, from neighboring floats to 1e-4 away, for lenses and planes without
// round numbers: whatever is left out is exact when run.
TEST(elision, never_wrongly_at_the_threshold) {
    int left = 0, kept = 0;
    for (const std::string coc : {"lens", "planes", "range"})
        for (int k = 0; k < 24; ++k) {
            const double s = 1.5 + 0.371 * k;
            // lens: R = 32 (1/s - w). planes: R = 3.2 (d - s)/4. range: R = 19.2 (d - s)/10.
            const double threshold = coc == "lens"     ? 1 / s - 0.5 / 32
                                     : coc == "planes" ? 1 / (s + 4 * 0.5 / 3.2)
                                                       : 1 / (s + 10 * 0.5 / 19.2);
            const Chain chain = chain_of("depth_of_field", {{"method", "gilham"},
                                                            {"coc", coc},
                                                            {"focus_distance", s},
                                                            {"near_blurry", 0.2},
                                                            {"near_sharp", 0.3},
                                                            {"far_sharp", s},
                                                            {"far_blurry", s + 4},
                                                            {"range", 10.0}});
            for (const int ulps : {-1000, -100, -3, -2, -1, 0, 1, 2, 3, 100, 1000}) {
                const float w = std::bit_cast<float>(std::bit_cast<int>(float(threshold)) + ulps);
                const FramePlanes planes = flat_planes(noise_image(3, 3, 4, 1), w);
                if (!plan_of(chain, planes).steps.empty()) {
                    ++kept;
                    continue;
                }
                ++left;
                const Stages stages =
                    filter_with_stages(chain, describe_round(planes), planes, {.elide = false});
                EXPECT_LE(std::abs(stages.stages.at(stage("coc")).at(0, 0)), 0.5f)
                    << coc << " s = " << s << ", " << ulps << " ulps";
            }
        }
    EXPECT_GT(left, 100);
    EXPECT_GT(kept, 300);
}

// A hint is preserved only where |R| is 0: the pass runs if a later one reads it.
TEST(elision, not_of_a_hint_that_is_read) {
    FramePlanes planes = focused_planes();
    planes[Role::hint] = constant_image(33, 21, {1, 1});
    const Chain chain = chain_of("depth_of_field", {{"method", "gilham"}});
    EXPECT_TRUE(plan_of(chain, planes).steps.empty());
    const PlanOptions with_hint{.outputs = {Role::color, Role::hint}};
    EXPECT_EQ(plan_of(chain, planes, with_hint).steps.size(), kSteps);
    // R = 0 at d = 4.2.
    const Chain in_focus = chain_of("depth_of_field", {{"method", "gilham"}, {"coc", "planes"}});
    EXPECT_TRUE(plan_of(in_focus, planes, with_hint).steps.empty());
}

}  // namespace
}  // namespace postchain::test
