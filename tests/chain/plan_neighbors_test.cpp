// Planes of the frames before and after: their roles, and which passes get them.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "chain/plan_print.h"
#include "tests/chain/plan_support.h"

namespace postchain::test {
namespace {

using ::testing::HasSubstr;

TEST(Planner, ReadsThePlanesOfANeighborOnlyWhereAPassDoes) {
    FrameDescription f = frame();
    for (Role role : kFileRoles)
        for (Neighbor neighbor : kNeighbors) f.planes.add(role_of(neighbor, role));
    EXPECT_EQ(make_plan(chain_of({"copy", "before"}), f)->reads,
              (RoleSet{Role::color, Role::color_before}));
    EXPECT_EQ(make_plan(chain_of({"copy"}), f)->reads, RoleSet{Role::color});
    EXPECT_EQ(plan_of(chain_of({"before"})).reads, RoleSet{Role::color});
    // As precise as the frame's own, whatever the bounds of the frame's color say.
    f.bounds.color_is_half = true;
    PlanOptions half_precision;
    half_precision.precision = Precision::fp16;
    const Plan half = *make_plan(chain_of({"before"}), f, half_precision);
    for (const auto& texture : half.textures)
        if (texture.imported) {
            EXPECT_EQ(texture.format, plane_format(channels_of(texture.role), Precision::fp32))
                << texture.name;
        }
}

// Their color has not been through a pass that moves color.
TEST(Planner, NeighborsAreGoneAfterAPassThatMovesColor) {
    FrameDescription f = frame();
    for (Role role : kFileRoles)
        for (Neighbor neighbor : kNeighbors) f.planes.add(role_of(neighbor, role));
    const Plan plan = *make_plan(chain_of({"before", "blur", "before"}), f);
    EXPECT_EQ(plan.reads, (RoleSet{Role::color, Role::color_before}));
    EXPECT_EQ(make_plan(chain_of({"blur", "before"}), f)->reads, RoleSet{Role::color});
    EXPECT_EQ(make_plan(chain_of({"blur", "before"}), f)->missing_neighbors,
              (std::map<Neighbor, std::string>{
                  {Neighbor::before,
                   "before stands after blur, which that frame's color has not been "
                   "through"}}));
    EXPECT_EQ(make_plan(chain_of({"before", "blur"}), f)->reads,
              (RoleSet{Role::color, Role::color_before}));
}

TEST(Planner, SaysWhichNeighborIsMissingWhereAPassCouldUseIt) {
    FrameDescription f = frame();
    f.missing_neighbors = {{Neighbor::before, "frame 0 is not on disk"}, {Neighbor::after, "cut"}};
    Chain chain = chain_of({"copy", "before"});
    const Plan plan = *make_plan(chain, f);
    EXPECT_EQ(plan.missing_neighbors,
              (std::map<Neighbor, std::string>{{Neighbor::before, "frame 0 is not on disk"}}));
    EXPECT_THAT(plan_as_text(plan), HasSubstr("no frame before: frame 0 is not on disk\n"));
    EXPECT_THAT(json_text(plan_json(plan)),
                HasSubstr(R"("missing_neighbors":{"before":"frame 0 is not on disk"})"));
    ASSERT_TRUE(off_table().set(chain.links[1].pass->parameters(), "off", true).ok());
    EXPECT_TRUE(make_plan(chain, f)->missing_neighbors.empty());
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
    Chain off = chain_of({"copy"});
    ASSERT_TRUE(off_table().set(off.links[0].pass->parameters(), "off", true).ok());
    const auto elided = make_plan(off, f);
    ASSERT_TRUE(elided.ok()) << elided.status().message();
    ASSERT_EQ(elided->outputs.count(Role::layers), 1u);
    EXPECT_EQ(elided->textures[size_t(elided->outputs.at(Role::layers))].layers, 2);
    f.layers = 0;
    EXPECT_EQ(make_plan(off, f).status().code(), StatusCode::internal);
}

TEST(Role, OfANeighborHasTheNameAndTheChannelsOfItsOwnFrame) {
    RoleSet all;
    for (Role role : kAllRoles) all.add(role);
    for (Neighbor neighbor : kNeighbors) {
        for (Role role : kNeighborRoles) {
            const Role there = role_of(neighbor, role);
            EXPECT_EQ(name_of(there), concat(name_of(role), "_", name_of(neighbor)));
            EXPECT_EQ(channels_of(there), channels_of(role));
            EXPECT_EQ((RoleSet{Role::hint, there}).of(neighbor), RoleSet{role});
            all.remove(there);
        }
    }
    for (Role role : kNeighborRoles) all.remove(role);
    EXPECT_EQ(all, (RoleSet{Role::hint, Role::behind}));
}

}  // namespace
}  // namespace postchain::test
