// The chain of double-precision references.
#include <gtest/gtest.h>

#include "tests/chain/plan_support.h"
#include "tests/support/status.h"

namespace postchain::test {
namespace {

// The frame has one pixel and color alone.
Result<ReferenceFrame> reference_of(const Chain& chain, const PlanOptions& options = {}) {
    FrameDescription f = frame();
    f.width = f.height = 1;
    f.planes = {Role::color};
    const FramePlanes planes = {{Role::color, ImageF(1, 1, 4, 3.0f)}};
    return run_reference(chain, f, planes, options);
}

double color_of(const Result<ReferenceFrame>& reference) {
    return must(reference).planes.at(Role::color).data[0];
}

// A pass that a requested rule elides is elided in the reference too.
TEST(Reference, LacksAPassThatMayBeMissing) {
    const Chain chain = chain_of({"copy", "makes"});
    EXPECT_EQ(color_of(reference_of(chain, {.rules_on = {kRuleMissingPlane}})), 7);
    EXPECT_FALSE(reference_of(chain).ok());
}

// Whatever the rules say: a pass that is off is run as it is described.
TEST(Reference, RunsWhatTheRulesElide) {
    for (const bool elide : {true, false})
        EXPECT_EQ(color_of(reference_of(with_off(chain_of({"copy"}), 0), {.elide = elide})), 7);
}

TEST(Reference, RunsPassesInOrderAndNamesStagesAsThePlanDoes) {
    const auto result = reference_of(chain_of({"copy", "copy"}));
    EXPECT_EQ(color_of(result), 15) << "2 (2*3 + 1) + 1";
    EXPECT_EQ(result->stages.at("0.copy.scratch").data[0], 7);
    EXPECT_EQ(result->stages.at("1.copy.scratch").data[0], 15);
}

}  // namespace
}  // namespace postchain::test
