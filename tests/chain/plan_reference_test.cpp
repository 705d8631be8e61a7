// The chain of double-precision references.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/chain/plan_support.h"

namespace postchain::test {
namespace {

// A frame of one pixel, color alone.
FramePlanes one_pixel() {
    return {{Role::color, ImageF(1, 1, 4, 3.0f)}};
}
FrameDescription one_pixel_frame() {
    FrameDescription f = frame();
    f.width = f.height = 1;
    f.planes = {Role::color};
    return f;
}

// A pass that a requested rule elides is elided in the reference too.
TEST(Reference, LacksAPassThatMayBeMissing) {
    PlanOptions asked;
    asked.rules_on = {kRuleMissingPlane};
    const auto result =
        run_reference(chain_of({"copy", "makes"}), one_pixel_frame(), one_pixel(), asked);
    ASSERT_TRUE(result.ok()) << result.status().message();
    EXPECT_EQ(result->planes.at(Role::color).data[0], 7.0);
    EXPECT_FALSE(run_reference(chain_of({"copy", "makes"}), one_pixel_frame(), one_pixel()).ok());
}

// Whatever the rules say: a pass that is off is run as it is described.
TEST(Reference, RunsWhatTheRulesElide) {
    Chain chain = chain_of({"copy"});
    ASSERT_TRUE(off_table().set(chain.links[0].pass->parameters(), "off", true).ok());
    for (const bool elide : {true, false}) {
        PlanOptions options;
        options.elide = elide;
        const auto result = run_reference(chain, one_pixel_frame(), one_pixel(), options);
        ASSERT_TRUE(result.ok()) << result.status().message();
        EXPECT_EQ(result->planes.at(Role::color).data[0], 7.0) << elide;
    }
}

TEST(Reference, RunsPassesInOrderAndNamesStagesAsThePlanDoes) {
    auto result = run_reference(chain_of({"copy", "copy"}), one_pixel_frame(), one_pixel());
    ASSERT_TRUE(result.ok());
    // 2 (2*3 + 1) + 1 = 15.
    EXPECT_EQ(result->planes.at(Role::color).data[0], 15.0);
    EXPECT_EQ(result->stages.at("0.copy.scratch").data[0], 7.0);
    EXPECT_EQ(result->stages.at("1.copy.scratch").data[0], 15.0);
}

}  // namespace
}  // namespace postchain::test
