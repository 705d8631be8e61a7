// Planes of the frames before and after: their roles, and which passes get them.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "chain/pass/resolved_chain.h"
#include "chain/plan/plan_print.h"
#include "tests/chain/plan_support.h"

namespace postchain::test {
namespace {

using ::testing::HasSubstr;

FrameDescription frame_with_neighbors() {
    FrameDescription f = frame();
    for (Role role : kFileRoles)
        for (Neighbor neighbor : kNeighbors) f.planes.add(role_of(neighbor, role));
    return f;
}

// Not after a pass that moves color: theirs has not been through it.
TEST(Planner, ReadsThePlanesOfANeighborOnlyWhereAPassDoes) {
    FrameDescription f = frame_with_neighbors();
    const RoleSet own = {Role::color}, both = {Role::color, Role::color_before};
    EXPECT_EQ(plan_of(chain_of({"copy", "before"}), {}, f).reads, both);
    EXPECT_EQ(plan_of(chain_of({"copy"}), {}, f).reads, own);
    EXPECT_EQ(plan_of(chain_of({"before"})).reads, own);
    EXPECT_EQ(plan_of(chain_of({"before", "blur", "before"}), {}, f).reads, both);
    EXPECT_EQ(plan_of(chain_of({"before", "blur"}), {}, f).reads, both);
    const Plan gone = plan_of(chain_of({"blur", "before"}), {}, f);
    EXPECT_EQ(gone.reads, own);
    EXPECT_EQ(gone.missing_neighbors,
              (std::map<Neighbor, std::string>{
                  {Neighbor::before,
                   "before stands after blur, which that frame's color has not been through"}}));
    EXPECT_TRUE(plan_of(chain_of({"blur_before"}), {}, f).missing_neighbors.empty());
    EXPECT_TRUE(plan_of(chain_of({"blur", "before"})).missing_neighbors.empty());
    EXPECT_EQ(
        plan_of(chain_of({"blur_before", "before"}), {}, f).missing_neighbors[Neighbor::before],
        "before stands after blur_before, which that frame's color has not been through");
    // As precise as the frame's own, whatever the bounds of the frame's color say.
    f.bounds.color_is_half = true;
    const Plan half = plan_of(chain_of({"before"}), {.precision = Precision::fp16}, f);
    for (const auto& texture : half.textures)
        if (texture.imported) {
            EXPECT_EQ(texture.format, plane_format(channels_of(texture.role), Precision::fp32))
                << texture.name;
        }
}

TEST(Planner, WhatIsOfAnotherColorIsNoPlaneAfterASpread) {
    EXPECT_EQ(without_neighbors(kEveryRole),
              (RoleSet{Role::color, Role::inverse_depth, Role::motion, Role::motion_back,
                       Role::hint, Role::layers, Role::mattes}));
}

TEST(Planner, SaysWhichNeighborIsMissingWhereAPassCouldUseIt) {
    FrameDescription f = frame();
    f.missing_neighbors = {{Neighbor::before, "frame 0 is not on disk"}, {Neighbor::after, "cut"}};
    const Plan plan = plan_of(chain_of({"copy", "before"}), {}, f);
    EXPECT_EQ(plan.missing_neighbors,
              (std::map<Neighbor, std::string>{{Neighbor::before, "frame 0 is not on disk"}}));
    EXPECT_THAT(plan_as_text(plan), HasSubstr("no frame before: frame 0 is not on disk\n"));
    EXPECT_THAT(json_text(plan_json(plan)),
                HasSubstr(R"("missing_neighbors":{"before":"frame 0 is not on disk"})"));
    EXPECT_TRUE(
        plan_of(with_off(chain_of({"copy", "before"}), 1), {}, f).missing_neighbors.empty());
}

// Layers that are not filtered must not come out as if they were.
TEST(Planner, RefusesAPassThatFiltersColorAloneWhereThereAreLayers) {
    FrameDescription f = frame();
    f.layers = 2;
    f.planes.add(Role::layers);
    const auto plan = make_plan(chain_of({"copy"}), f);
    ASSERT_FALSE(plan.ok());
    EXPECT_EQ(plan.status().code(), StatusCode::chain);
    EXPECT_THAT(plan.status().message(), HasSubstr("passes[0].copy: filters color alone"));
    // If elided it hands both on; and layers are an output without a request.
    const Chain off = with_off(chain_of({"copy"}), 0);
    const Plan elided = plan_of(off, {}, f);
    EXPECT_EQ(elided.textures.at(size_t(elided.outputs.at(Role::layers))).slices, 2);
    f.layers = 0;
    EXPECT_EQ(make_plan(off, f).status().code(), StatusCode::internal);
}

}  // namespace
}  // namespace postchain::test
