// The planner, with the small passes of plan_support.h and no GL.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "chain/base/text.h"
#include "chain/frame/behind.h"
#include "chain/pass/resolved_chain.h"
#include "chain/plan/plan_print.h"
#include "tests/chain/plan_support.h"
#include "tests/support/status.h"

namespace postchain::test {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

// A hint is made where a later pass reads it, or takes it on to one that does.
TEST(Planner, StepsOfChains) {
    struct Case {
        std::initializer_list<const char*> passes;
        const char* steps;
        std::set<std::string> rules_off = {};
    };
    const Case cases[] = {
        {{"copy", "copy"}, "0.first 0.second 1.first 1.second"},
        {{"makes"}, "0.first 0.second"},
        {{"makes"}, "0.first 0.second 0.hint", {kRuleUnusedStep, kRuleUnusedOutput}},
        {{"makes", "reads"}, "0.first 0.second 0.hint 1.first 1.second"},
        {{"reads", "makes"}, "0.first 0.second 1.first 1.second"},
        {{"makes", "carries"}, "0.first 0.second 1.first 1.second"},
        {{"makes", "carries", "reads"},
         "0.first 0.second 0.hint 1.first 1.second 1.carry 2.first 2.second"},
        {{"spare"}, "0.first 0.second"},
        {{"spare"}, "0.spare 0.first 0.second", {kRuleUnusedStep}}};
    for (const Case& one : cases)
        EXPECT_EQ(
            joined(steps_of(plan_of(chain_of(one.passes), {.rules_off = one.rules_off})), " "),
            one.steps);
    // The reader sees the carried plane, not the first one.
    const Plan plan = plan_of(chain_of({"makes", "carries", "reads"}));
    bool reads_carried = false;
    for (const auto& binding : plan.steps[6].bindings)
        reads_carried |= plan.textures[size_t(binding.texture)].name == "1.carries.hint";
    EXPECT_TRUE(reads_carried);
}

TEST(Planner, APassDoesNotReadWhatItLeavesForLaterOnes) {
    const Chain chain = chain_of({"makes", "carries", "reads"});
    EXPECT_TRUE(readable_after(chain, 0).has(Role::hint));
    EXPECT_TRUE(readable_after(chain, 1).has(Role::hint));
    EXPECT_EQ(readable_after(chain, 2), RoleSet{});
}

TEST(Planner, IsPureAndComparesEqual) {
    const Chain chain = chain_of({"makes", "carries", "reads"});
    EXPECT_EQ(plan_of(chain), plan_of(chain));
    EXPECT_EQ(plan_of(chain).hash(), plan_of(chain.clone()).hash());
    EXPECT_NE(plan_of(chain).hash(), plan_of(chain_of({"makes", "reads"})).hash());
}

TEST(Planner, ReaderThatIsLeftOutWantsNoHint) {
    const Chain chain = with_off(chain_of({"makes", "reads"}), 1);
    const Plan plan = plan_of(chain);
    EXPECT_THAT(steps_of(plan), ElementsAre("0.first", "0.second"));
    ASSERT_FALSE(plan.elisions.empty());
    // scratch 40*30*8 and out 40*30*16.
    EXPECT_EQ(plan.elisions[0], (Elision{.pass = 1,
                                         .rule = kRuleConfiguration,
                                         .fact = {.name = "off", .value = 1},
                                         .saving = {28800, 2, 3}}));
}

// Neither a hint of an earlier pass nor the frame's own stands in for one that was not made.
TEST(Planner, APassThatIsLeftOutLeavesNoEarlierHint) {
    FrameDescription hinted = frame();
    hinted.planes.add(Role::hint);
    const struct {
        std::initializer_list<const char*> passes;
        size_t off;
        FrameDescription frame;
        bool hint;
    } cases[] = {{{"makes", "makes"}, 1, frame(), false},
                 {{"makes", "makes"}, 0, frame(), true},
                 {{"makes", "copy"}, 1, frame(), true},
                 {{"makes"}, 0, hinted, false},
                 {{"copy"}, 0, hinted, true}};
    for (const auto& [passes, off, given, hint] : cases) {
        const Plan plan =
            plan_of(with_off(chain_of(passes), off), {.outputs = {Role::color, Role::hint}}, given);
        EXPECT_EQ(plan.outputs.contains(Role::hint), hint) << *passes.begin() << " off: " << off;
    }
}

TEST(Planner, RulesCanBeSwitchedOffTogetherOrByName) {
    const Chain chain = with_off(chain_of({"copy"}), 0);
    EXPECT_TRUE(plan_of(chain).steps.empty());
    EXPECT_EQ(plan_of(chain, {.elide = false}).steps.size(), 2u);
    EXPECT_EQ(plan_of(chain, {.rules_off = {kRuleConfiguration}}).steps.size(), 2u);
    EXPECT_TRUE(plan_of(chain, {.rules_off = {kRuleFacts}}).steps.empty());
}

TEST(Planner, MissingPlaneNamesPassAndWhatThereIs) {
    FrameDescription f = frame();
    f.planes = {Role::color, Role::inverse_depth};
    const Status status = make_plan(chain_of({"copy", "makes"}), f).status();
    EXPECT_EQ(status.code(), StatusCode::input);
    EXPECT_THAT(status.message(), HasSubstr("passes[1].makes: needs motion; the frame has color"));
}

TEST(Planner, StepsThatNothingReadsAreLeftOutWithTheirSaving) {
    const Plan plan = plan_of(chain_of({"spare"}));
    EXPECT_EQ(plan.reads, RoleSet{Role::color});
    ASSERT_GE(plan.elisions.size(), 1u);
    EXPECT_EQ(plan.elisions[0], (Elision{.pass = 0,
                                         .kind = ElisionKind::step,
                                         .item = "spare",
                                         .rule = kRuleUnusedStep,
                                         .fact = {"not asked for"},
                                         .saving = {400, 1, 100}}));
    for (const auto& texture : plan.textures) EXPECT_NE(texture.name, "0.spare.spare");
}

// Only the hint is requested: the step that makes color has no reader.
TEST(Planner, WhatNobodyReadsIsLeftOutFromTheEnd) {
    const Chain chain = chain_of({"makes", "copy"});
    const Plan plan = plan_of(chain, {.outputs = {Role::hint}});
    EXPECT_THAT(steps_of(plan), ElementsAre("0.hint"));
    EXPECT_TRUE(plan.passes[1].elided);
    EXPECT_FALSE(plan.passes[0].elided);
    size_t unread = 0;
    for (const auto& left : plan.elisions) unread += left.rule == kRuleUnusedOutput;
    EXPECT_EQ(unread, 4u);
    const PlanOptions rule_off = {.rules_off = {kRuleUnusedOutput}, .outputs = {Role::hint}};
    EXPECT_EQ(plan_of(chain, rule_off).steps.size(), 5u);
    EXPECT_EQ(plan_of(chain, {.outputs = {Role::color, Role::hint}}).steps.size(), 5u);
}

TEST(Planner, PassThatLacksAPlaneIsLeftOutWhenAskedFor) {
    FrameDescription f = frame();
    f.planes = {Role::color};
    f.not_converted = {Role::inverse_depth};
    PlanOptions asked = {.rules_on = {kRuleMissingPlane}};
    const Plan plan = plan_of(chain_of({"copy", "makes"}), asked, f);
    EXPECT_THAT(steps_of(plan), ElementsAre("0.first", "0.second"));
    EXPECT_EQ(plan.elisions[0],
              (Elision{.pass = 1,
                       .rule = kRuleMissingPlane,
                       .fact = {"needs motion; the frame has color, inverse_depth"}}));
    asked.elide = false;
    EXPECT_FALSE(make_plan(chain_of({"copy", "makes"}), f, asked).ok());
    // A pass that is off does without.
    const Plan off = plan_of(with_off(chain_of({"makes"}), 0), {}, f);
    EXPECT_EQ(off.elisions[0].rule, kRuleConfiguration);
}

TEST(Planner, ABlockThatNobodyFillsIsAnError) {
    const Status status = make_plan(chain_of({"copy", "forgets"}), frame()).status();
    EXPECT_EQ(status.code(), StatusCode::internal);
    EXPECT_EQ(status.message(), "passes[1].forgets: step first: write_uniforms() sets no Block");
}

// Planes that were not decoded are listed, and the saving of an elided pass counts its work on
// them.
TEST(Planner, PlanesThatWereNotDecodedAreLeftOut) {
    FrameDescription f = frame();
    f.planes = {Role::color};
    f.not_converted = {Role::motion};
    const Plan plan = plan_of(with_off(chain_of({"makes"}), 0), {}, f);
    ASSERT_EQ(plan.elisions.size(), 2u);
    EXPECT_EQ(plan.elisions[0].saving.dispatches, 2);
    EXPECT_EQ(plan.elisions[1], (Elision{.kind = ElisionKind::plane,
                                         .item = "motion",
                                         .rule = kRuleUnusedPlane,
                                         .fact = {"no step reads it: not converted"},
                                         .saving = {.bytes = 9600}}));
}

// Two passes of one type: each entry says of which.
TEST(Planner, ElisionsNameTheirPass) {
    const Chain chain = with_off(chain_of({"spare", "copy", "spare"}), 1);
    const Plan plan = plan_of(chain);
    std::vector<std::string> items;
    for (const auto& elision : plan.elisions)
        if (elision.kind != ElisionKind::plane) items.push_back(item_text(elision, plan));
    EXPECT_THAT(items, ElementsAre("copy", "passes[0].spare.spare", "passes[2].spare.spare"));
}

// Two passes in a row, in either order.
TEST(Guarantees, OfAChainAreThoseOfAllItsPasses) {
    Guarantees one, other;
    one.keeps_constants = other.keeps_constants = true;
    one.convex = 0.25;
    other.convex = 0.5;
    one.lattice_px = 6;
    other.lattice_px = 4;
    one.symmetries = {Symmetry::mirror, Symmetry::shift};
    other.symmetries = {Symmetry::flip, Symmetry::shift};
    one.light = Light::kept;
    other.light = Light::not_more;
    one.driven_by = {Role::motion};
    other.driven_by = {Role::color};
    Guarantees nothing;
    nothing.light = Light::any;
    for (const bool swapped : {false, true}) {
        const Guarantees both = swapped ? other.then(one) : one.then(other);
        EXPECT_TRUE(both.keeps_constants);
        EXPECT_EQ(both.convex, 0.75);
        EXPECT_EQ(both.lattice_px, 12);
        EXPECT_EQ(both.symmetries, std::set{Symmetry::shift});
        EXPECT_EQ(both.light, Light::not_more);
        EXPECT_EQ(both.driven_by, (RoleSet{Role::color, Role::motion}));
        const Guarantees none = swapped ? nothing.then(one) : one.then(nothing);
        EXPECT_FALSE(none.keeps_constants);
        EXPECT_FALSE(none.convex);
        EXPECT_EQ(none.lattice_px, 0);
        EXPECT_TRUE(none.symmetries.empty());
        EXPECT_EQ(none.light, Light::any);
        EXPECT_TRUE(none.driven_by.empty()) << "a pass that always acts";
    }
}

TEST(Fact, IsASentence) {
    EXPECT_EQ(text_of(Fact{"the frame has one depth"}), "the frame has one depth");
    EXPECT_EQ(text_of(Fact{.name = "shutter_frames", .value = 0}), "shutter_frames is 0");
    Fact fact{.name = "largest half-velocity", .value = 0.31, .limit = 0.5, .unit = "px"};
    EXPECT_EQ(text_of(fact), "largest half-velocity 0.31 px <= 0.5 px");
    fact.value.reset();
    fact.relation = Fact::Relation::at_least;
    EXPECT_EQ(text_of(fact), "largest half-velocity >= 0.5 px");
    fact.relation = Fact::Relation::below;
    fact.unit.clear();
    EXPECT_EQ(text_of(fact), "largest half-velocity < 0.5");
}

TEST(Planner, RulesInUse) {
    PassType type = *small_passes().find("copy");
    type.rules = {{"still", true, "what is still"}, {"alike", false, "what is alike"}};
    const PassRegistry with_rules({type, *small_passes().find("spare")});
    Chain chain;
    chain.append(with_rules, "spare");
    PlanOptions options;
    // Those of the passes in the chain, and of no other.
    EXPECT_EQ(options.rules(chain).count("still"), 0u);
    chain.append(with_rules, "copy");
    EXPECT_EQ(options.rules(chain),
              (RuleNames{kRuleConfiguration, kRuleFacts, kRuleCameraCut, kRuleUnusedPlane,
                         kRuleUnusedStep, kRuleUnusedOutput, "still"}));
    options.rules_on = {"alike"};
    options.rules_off = {"still", kRuleFacts};
    EXPECT_EQ(options.rules(chain).count("still"), 0u);
    EXPECT_EQ(options.rules(chain).count(kRuleFacts), 0u);
    EXPECT_EQ(options.rules(chain).count("alike"), 1u);
    options.elide = false;
    EXPECT_TRUE(options.rules(chain).empty());
    EXPECT_EQ(elision_rules(with_rules).size(), chain_rules().size() + 2);
}

TEST(Plan, WhatTheDeviceFoundIsCounted) {
    Plan plan;
    plan.passes = {{"p", "", false}};
    plan.textures.resize(2);
    plan.textures[0].name = "0.p.still";
    plan.textures[1].name = "0.p.needed";
    const Elision plain{.pass = 0, .item = "gather", .rule = "still", .fact = {"still"}};
    Elision still = plain, unread = plain;
    still.kind = unread.kind = ElisionKind::blocks;
    still.work_list = 0;
    still.taps_per_block = 10;
    unread.work_list = 1;
    unread.outside = true;
    unread.taps_per_block = 7;
    plan.elisions = {plain, still, unread};
    const std::vector<WorkDone> some = {{"0.p.still", 3, 12}, {"0.p.needed", 8, 12}};
    EXPECT_EQ(found_in(plain, plan, some), plain);
    ASSERT_TRUE(found_in(still, plan, some) && found_in(unread, plan, some));
    EXPECT_EQ(found_in(still, plan, some)->saving.taps, 30u);
    EXPECT_EQ(found_in(unread, plan, some)->saving.taps, 28u);
    // Without blocks nothing was elided.
    const std::vector<WorkDone> none = {{"0.p.still", 0, 12}, {"0.p.needed", 12, 12}};
    EXPECT_FALSE(found_in(still, plan, none));
    EXPECT_FALSE(found_in(unread, plan, none));
    EXPECT_THAT(plan_as_text(plan), HasSubstr("(saves 10 taps a block; the device finds them)"));
}

// A compiled plan takes the values of another one, and its size; all else is compiled.
TEST(Plan, OneOfAnotherShapeDiffersInAnythingThatIsCompiled) {
    const Plan plan = plan_of(chain_of({"makes", "carries", "reads"}));
    constexpr void (*kCompiled[])(Plan&) = {
        [](Plan& p) { p.steps.pop_back(); },
        [](Plan& p) { p.steps[1].pass = 2; },
        [](Plan& p) { p.steps[1].name = "other"; },
        [](Plan& p) { p.steps[1].program.file = "other.comp"; },
        [](Plan& p) { p.steps[1].program.defines["A"] = "1"; },
        [](Plan& p) { ++p.steps[0].bindings[1].unit; },
        [](Plan& p) { ++p.steps[0].bindings[1].texture; },
        [](Plan& p) { p.steps[0].bindings[0].access = Access::read; },
        [](Plan& p) { p.steps[0].bindings.pop_back(); },
        [](Plan& p) { p.steps[1].uniforms.resize(16); },
        [](Plan& p) { p.steps[1].uniforms_type = "Block"; },
        [](Plan& p) { p.steps[1].spread = Area::fixed(3, 2); },
        [](Plan& p) { p.steps[1].groups[2] = 2; },
        [](Plan& p) { p.steps[1].work_list = 0; },
        [](Plan& p) { p.steps[1].first_layer = 1; },
        [](Plan& p) { p.outputs[Role::hint] = 0; },
        [](Plan& p) { p.outputs[Role::color] = 0; },
        [](Plan& p) { p.passes.pop_back(); },
        [](Plan& p) { p.passes[1].tiles.least_px = 8; },
        [](Plan& p) { p.textures.pop_back(); },
        [](Plan& p) { p.textures[3].format = Format::r8; },
        [](Plan& p) { p.textures[3].slices = 2; },
        [](Plan& p) { p.textures[3].area = Area::fixed(40, 30); },
        [](Plan& p) { p.textures[3].imported = true; },
        [](Plan& p) { p.textures[3].last_step = 5; }};
    for (size_t i = 0; i < std::size(kCompiled); ++i) {
        Plan other = plan;
        kCompiled[i](other);
        EXPECT_FALSE(same_shape(plan, other)) << i;
        EXPECT_FALSE(same_shape(other, plan)) << i;
    }
    Plan values = plan;
    fit(values, 70, 50);
    values.frame_number = 7;
    values.passes[1].text = "seed: 7";
    values.passes[1].tiles.px = 8;
    values.steps[0].taps = values.steps[0].group_taps = 99;
    values.elisions.push_back({.pass = 1, .rule = "still"});
    EXPECT_TRUE(same_shape(plan, values));
    EXPECT_NE(plan, values);
}

// Textures and work groups by the frame's size, and by the tiles of their pass.
TEST(Plan, FitsAnotherSize) {
    Plan plan;
    plan.passes = {{"a", "", false, {}}, {"b", "", false, {10, 5}}};
    plan.textures.resize(3);
    plan.textures[1].pass = 1;
    plan.textures[1].area = Area().tiles();
    plan.textures[2].format = Format::work_list;
    plan.textures[2].area = Area().in_squares(kBlockPx);
    plan.steps.resize(2);
    plan.steps[0].groups[2] = plan.steps[1].groups[2] = 3;
    plan.steps[1].pass = 1;
    plan.steps[1].spread = Area().tiles();
    fit(plan, 70, 35);
    EXPECT_EQ(plan.width, 70);
    EXPECT_EQ(plan.height, 35);
    const std::pair<int, int> sizes[] = {{70, 35}, {7, 4}, {5 * 3, 1}};
    for (size_t i = 0; i < std::size(sizes); ++i)
        EXPECT_EQ(std::pair(plan.textures[i].width, plan.textures[i].height), sizes[i]) << i;
    EXPECT_EQ(plan.steps[0].groups, (std::array{5, 3, 3}));
    EXPECT_EQ(plan.steps[1].groups, (std::array{7, 4, 3}));
}

TEST(Plan, FormatsOfPlanes) {
    const std::tuple<int, Format, Format> formats[] = {{1, Format::r32f, Format::r16f},
                                                       {2, Format::rg32f, Format::rg16f},
                                                       {4, Format::rgba32f, Format::rgba16f}};
    for (const auto& [channels, whole, half] : formats) {
        EXPECT_EQ(plane_format(channels, Precision::fp32), whole);
        EXPECT_EQ(plane_format(channels, Precision::fp16), half);
    }
    EXPECT_EQ((Storage{Format::r16f, 7, 5, 3}.text()), "7x5x3 r16f");
    EXPECT_EQ((Storage{Format::r16f, 7, 5, 3}.bytes()), 7u * 5 * 3 * 2);
    EXPECT_EQ((Storage{Format::r16f, 7, 5, 0}.text()), "7x5 r16f");
}

TEST(Plan, PlanesOfAStack) {
    FrameDescription f = frame();
    f.layers = 2;
    f.mattes = {-1, 2, 0};  // of each pass
    EXPECT_EQ(stacked_planes(Role::color, f), 0);
    for (const Role role : {Role::layers, Role::layers_before, Role::layers_after})
        EXPECT_EQ(stacked_planes(role, f), 2);
    for (const Role role : {Role::mattes, Role::mattes_before, Role::mattes_after})
        EXPECT_EQ(stacked_planes(role, f), 3);
    EXPECT_EQ(stacked_planes(Role::behind, f), 3 + 2);
}

// The second surface keeps both of its motions; without the one from before, the other counts.
TEST(Plan, TheFrameBehindIsOneStack) {
    FramePlanes planes;
    float value = 0;
    for (const Role role : {Role::color, Role::inverse_depth, Role::motion, Role::motion_back})
        for (float& one : (planes[role] = ImageF(2, 1, channels_of(role))).data) one = ++value;
    planes[Role::layers] = ImageF(2, 2, 4, 99);
    ImageF stack = stack_behind(planes);
    EXPECT_EQ(stack.height, 5);
    stack.data.resize(3 * 8);
    EXPECT_THAT(stack.data, ElementsAre(1, 2, 3, 4, 5, 6, 7, 8,   // color
                                        9, 0, 0, 0, 10, 0, 0, 0,  // inverse depth
                                        11, 12, 15, 16, 13, 14, 17, 18));
    planes.erase(Role::motion_back);
    EXPECT_EQ(stack_behind(planes).at(1, 2, 3), 14);
    planes.erase(Role::motion);
    EXPECT_EQ(stack_behind(planes).at(1, 2, 3), 0);
}

TEST(Chain, ACopyHasAllOfIt) {
    Chain chain = chain_of({"makes", "copy"});
    chain.links[0].matte = "hero";
    chain.links[0].matte_effect = MatteEffect::unmoved;
    chain.camera.f_stop = 2;
    chain.origins["camera.f_stop"] = {kFromOption, "--set camera.f_stop=2"};
    EXPECT_NE(chain.text(), chain_of({"makes", "copy"}).text());
    const Chain copy = chain.clone();
    EXPECT_EQ(copy.text(), chain.text());
    EXPECT_EQ(copy.origins, chain.origins);
    EXPECT_EQ(chain.that_guarantees([](const Guarantees&) { return true; })->text(), chain.text());
    EXPECT_FALSE(chain.that_guarantees([](const Guarantees&) { return false; }));
}

TEST(Planner, LifetimesAndPeakByHand) {
    // Steps 0..3; textures: input 0..0 (16 B/px), scratch0 0..1 (8), out0 1..2 (16),
    // scratch1 2..3 (8), out1 3..3 (16). Alive: 24, 24, 24, 24 bytes per pixel; 1200 pixels.
    const Plan plan = plan_of(chain_of({"copy", "copy"}));
    std::vector<std::pair<int, int>> steps;
    for (const PlanTexture& texture : plan.textures)
        steps.emplace_back(texture.first_step, texture.last_step);
    // Nothing reads depth and motion. The output is alive after the last step.
    EXPECT_THAT(steps,
                ElementsAre(std::pair(0, 0), std::pair(-1, -1), std::pair(-1, -1), std::pair(0, 1),
                            std::pair(1, 2), std::pair(2, 3), std::pair(3, 4)));
    EXPECT_EQ(plan.peak_bytes(), 24u * 1200u);
    EXPECT_EQ(plan.transient_bytes(), 48u * 1200u);
    // An output that no step touches, and one that the first step makes.
    const auto life = [](const Plan& of, Role role) {
        const PlanTexture& output = of.textures[size_t(of.outputs.at(role))];
        return std::pair(output.first_step, output.last_step);
    };
    EXPECT_EQ(life(plan_of(with_off(chain_of({"copy"}), 0)), Role::color), std::pair(-1, -1));
    EXPECT_EQ(life(plan_of(chain_of({"makes"}), {.outputs = {Role::hint}}), Role::hint),
              std::pair(0, 1));
}

TEST(Planner, PrintsNameEverythingThatRunsAndIsLeftOut) {
    const Chain chain = with_off(chain_of({"makes", "reads", "copy"}), 2);
    const Plan plan = plan_of(chain);
    for (const std::string& text :
         {plan_as_text(plan), json_text(plan_json(plan)), plan_as_dot(plan)}) {
        EXPECT_THAT(text, HasSubstr("makes"));
        EXPECT_THAT(text, HasSubstr("0.makes.hint"));
        EXPECT_THAT(text, HasSubstr("copy"));
    }
    EXPECT_THAT(plan_as_text(plan), HasSubstr("left out copy [off_by_configuration]: off is 1"));
    EXPECT_THAT(plan_as_dot(plan), HasSubstr("copy\\nleft out"));
    EXPECT_EQ(json_text(plan_json(plan)).find('\n'), std::string::npos);
}

// The unit that makes a distance of it may be stated later: it counts by itself.
TEST(CameraText, HasTheFocusOfTheMetadata) {
    Camera meters;
    meters.focus_distance = 2;
    Camera stated = meters;
    meters.metadata_focus_m = 2;
    EXPECT_NE(meters.text(), stated.text());
}

// Planes of the frames before and after: their roles, and which passes get them.

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

// The chain of double-precision references.

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
