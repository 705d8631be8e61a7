// Two plans in one: what is shared, and that it changes no bit.
#include "chain/merge.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "chain/plan_print.h"
#include "tests/support/gpu.h"
#include "tests/support/images.h"
#include "tests/support/status.h"

namespace postchain {
namespace {

// A plan by hand: every step reads one texture and writes the next, "program" is its letter.
// chain_plan("xyz"): color -x-> 1 -y-> 2 -z-> 3 = output.
Plan chain_plan(const std::string& programs, Format format = Format::rgba32f) {
    Plan plan;
    plan.width = plan.height = 8;
    plan.passes = {{"p", programs, false}};
    plan.textures = {{"input.color", Format::rgba32f, 8, 8, true, Role::color, -1, -1}};
    for (int i = 0; i < int(programs.size()); ++i) {
        plan.textures.push_back({concat("0.p.t", i), format, 8, 8, false, Role::color, i, i + 1});
        Step step;
        step.name = step.program.file = programs.substr(size_t(i), 1);
        step.bindings = {{0, i, Access::sample_nearest}, {0, i + 1, Access::write}};
        plan.steps.push_back(step);
    }
    plan.outputs[Role::color] = int(programs.size());
    return plan;
}

std::string programs_of(const Plan& plan) {
    std::string text;
    for (const auto& step : plan.steps) text += step.program.file;
    return text;
}

TEST(MergePlans, SharesAsLongAsWhatIsReadIsTheSame) {
    // The z of both read different things: y's result here, w's there.
    const MergedPlan merged = merge_plans(chain_plan("xyz"), chain_plan("xwz"));
    EXPECT_EQ(programs_of(merged.plan), "xyzwz");
    EXPECT_EQ(merged.shared_steps, 1);
    // w reads what A's x wrote.
    EXPECT_EQ(merged.plan.steps[3].bindings[0].texture, 1);
    EXPECT_EQ(merged.outputs[0].at(Role::color), 3);
    EXPECT_EQ(merged.plan.textures[size_t(merged.outputs[1].at(Role::color))].name, "b.0.p.t2");
    EXPECT_EQ(merged.plan.steps[3].pass, 1);
    // color, A's three, B's two.
    EXPECT_EQ(merged.plan.textures.size(), 6u);
}

// Whose an entry is says its pass; a plane is elided where neither plan reads it.
TEST(MergePlans, ElisionsKeepTheirPass) {
    Plan a = chain_plan("xyz"), b = chain_plan("xw");
    const Elision motion{.kind = ElisionKind::plane, .item = "motion", .rule = kRuleUnusedPlane};
    const Elision depth{
        .kind = ElisionKind::plane, .item = "inverse_depth", .rule = kRuleUnusedPlane};
    Elision blocks{.pass = 0, .kind = ElisionKind::blocks, .item = "gather", .rule = "still"};
    blocks.work_list = 2;  // b's second texture, which is new in the merged plan
    a.elisions = {motion, depth, {.pass = 0, .kind = ElisionKind::step, .item = "s"}};
    b.elisions = {depth, blocks};
    const MergedPlan merged = merge_plans(a, b);
    ASSERT_EQ(merged.plan.elisions.size(), 3u);
    EXPECT_EQ(merged.plan.elisions[0], depth);
    EXPECT_EQ(merged.plan.elisions[1], a.elisions[2]);
    const Elision& moved = merged.plan.elisions[2];
    EXPECT_EQ(moved.pass, 1);
    EXPECT_EQ(merged.plan.textures[size_t(moved.work_list)].name, "b.0.p.t1");
    EXPECT_EQ(item_text(moved, merged.plan), "passes[1].p.gather");
    EXPECT_EQ(merged.elisions[0], a.elisions);
    ASSERT_EQ(merged.elisions[1].size(), 2u);
    EXPECT_EQ(merged.elisions[1][1].pass, 0);
    EXPECT_EQ(merged.elisions[1][1].work_list, moved.work_list);
}

TEST(MergePlans, EqualPlansRunOnce) {
    const MergedPlan merged = merge_plans(chain_plan("xyz"), chain_plan("xyz"));
    EXPECT_EQ(programs_of(merged.plan), "xyz");
    EXPECT_EQ(merged.shared_steps, 3);
    EXPECT_EQ(merged.outputs[0], merged.outputs[1]);
}

TEST(MergePlans, ResultsLiveUntilTheEnd) {
    // B is the first step of A: what A only passes through must still be there at the end.
    const MergedPlan merged = merge_plans(chain_plan("xyz"), chain_plan("x"));
    EXPECT_EQ(merged.outputs[1].at(Role::color), 1);
    EXPECT_EQ(merged.plan.textures[1].last_step, 3);  // one past the three steps
    EXPECT_EQ(merged.plan.textures[3].last_step, 3);
    EXPECT_EQ(merged.plan.textures[2].last_step, 2);
}

TEST(MergePlans, BlockFormatAccessAndGroupsDistinguish) {
    const Plan a = chain_plan("x");
    const auto shared_with = [&](auto change) {
        Plan b = a;
        change(b.steps[0]);
        return merge_plans(a, b).shared_steps;
    };
    EXPECT_EQ(shared_with([](Step&) {}), 1);
    EXPECT_EQ(shared_with([](Step& s) { s.name = "another name for the same work"; }), 1);
    EXPECT_EQ(shared_with([](Step& s) { s.uniforms.resize(16); }), 0);
    EXPECT_EQ(shared_with([](Step& s) { s.bindings[0].access = Access::write; }), 0);
    EXPECT_EQ(shared_with([](Step& s) { s.groups = {2, 1, 1}; }), 0);
    EXPECT_EQ(shared_with([](Step& s) { s.first_layer = 4; }), 0);
    EXPECT_EQ(shared_with([](Step& s) { s.program.defines["N"] = "2"; }), 0);
    EXPECT_EQ(merge_plans(a, chain_plan("x", Format::rgba16f)).shared_steps, 0);
}

// Two steps that write their own blocks of one texture: both are shared, or neither.
TEST(MergePlans, StepsThatWriteTogetherAreSharedTogether) {
    Plan a = chain_plan("xyz");
    a.steps[1].bindings = {{0, 0, Access::sample_nearest}, {0, 1, Access::write}};
    a.steps[2].bindings = {{0, 1, Access::sample_nearest}, {0, 3, Access::write}};
    const MergedPlan merged = merge_plans(a, a);
    EXPECT_EQ(merged.shared_steps, 3);
    EXPECT_EQ(merged.outputs[1].at(Role::color), 3);
    Plan b = a;
    b.steps[1].program.file = "w";  // the second writer is another: z reads another texture then
    const MergedPlan apart = merge_plans(a, b);
    EXPECT_EQ(apart.shared_steps, 0);
    EXPECT_EQ(programs_of(apart.plan), "xyzxwz");
    EXPECT_EQ(apart.plan.steps[3].bindings[1].texture, apart.plan.steps[4].bindings[1].texture);
    EXPECT_NE(apart.plan.steps[3].bindings[1].texture, 1);
    // A reader between the writers sees half of it, so it must stand there in both.
    Plan early = a;
    std::swap(early.steps[1], early.steps[2]);
    EXPECT_EQ(merge_plans(early, early).shared_steps, 3);
    EXPECT_EQ(merge_plans(early, a).shared_steps, 0);
    EXPECT_EQ(merge_plans(a, early).shared_steps, 0);
}

TEST(MergePlans, WhatIsWrittenOverIsSharedWithWhatWritesOverIt) {
    Plan a = chain_plan("xy");
    a.steps[1].bindings[1].texture = 1;  // y reads and writes over what x wrote
    a.outputs[Role::color] = 1;
    const MergedPlan merged = merge_plans(a, chain_plan("x"));
    EXPECT_EQ(merged.shared_steps, 0);
    EXPECT_NE(merged.outputs[1].at(Role::color), 1);
    // The other way round.
    EXPECT_EQ(merge_plans(chain_plan("x"), a).shared_steps, 0);
    EXPECT_EQ(merge_plans(a, a).shared_steps, 2);
}

TEST(MergePlans, PlansWithoutStepsHandTheInputOn) {
    Plan none = chain_plan("");
    const MergedPlan merged = merge_plans(chain_plan("x"), none);
    EXPECT_EQ(merged.outputs[1].at(Role::color), 0);
    EXPECT_EQ(programs_of(merge_plans(none, chain_plan("x")).plan), "x");
}

}  // namespace
}  // namespace postchain
