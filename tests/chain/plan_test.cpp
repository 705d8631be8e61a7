// The planner, with small passes of this file and no GL.
#include "chain/plan.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "chain/plan_print.h"
#include "chain/planner.h"

namespace postchain {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

struct Nothing {
    bool off = false;
};

const ParameterTable& table() {
    static const ParameterTable made = ParameterTableBuilder<Nothing>()
                                           .boolean("off", &Nothing::off, {.help = "do nothing"})
                                           .table();
    return made;
}

// A pass that copies color through one scratch texture; derived ones change what they use.
class Copy : public Pass {
  public:
    RoleUse roles() const override { return {{Role::color}, {}, {}, {}}; }
    Reach reach(const FrameDescription&) const override { return {0, 0}; }
    Status check(const FrameDescription&) const override { return Status(); }
    std::optional<Identity> identity(const PlanContext&) const override {
        if (!parameters_.off) return std::nullopt;
        return Identity{kRuleConfiguration, {.name = "off", .value = 1}};
    }
    void plan(PassPlanner& p) const override {
        const auto& frame = p.context().frame;
        const TextureId scratch = p.texture("scratch", Format::rgba16f, frame.width, frame.height);
        const TextureId out = p.texture("out", Format::rgba32f, frame.width, frame.height);
        Step first;
        first.name = "first";
        first.bindings = {{0, p.input(Role::color), Access::sample_nearest},
                          {0, scratch, Access::write}};
        add_inputs(p, first);
        first.taps = 3;
        p.step(first);
        Step second;
        second.name = "second";
        second.bindings = {{0, scratch, Access::sample_nearest}, {0, out, Access::write}};
        p.step(second);
        p.output(Role::color, out);
    }
    void reference(const PlanContext&, ReferenceFrame& frame) const override {
        for (double& value : frame.planes.at(Role::color).data) value = 2 * value + 1;
        frame.stages["scratch"] = frame.planes.at(Role::color);
    }
    ParameterRef parameters() override { return &parameters_; }

  protected:
    virtual void add_inputs(PassPlanner&, Step&) const {}
    Nothing parameters_;
};

class MakesHint : public Copy {
    RoleUse roles() const override { return {{Role::color, Role::motion}, {}, {Role::hint}, {}}; }
    void add_inputs(PassPlanner& p, Step& step) const override {
        step.bindings.push_back({1, p.input(Role::motion), Access::sample_nearest});
    }
    void plan(PassPlanner& p) const override {
        Copy::plan(p);
        if (!p.wanted(Role::hint)) return;
        const auto& frame = p.context().frame;
        const TextureId hint = p.texture("hint", Format::rg16f, frame.width, frame.height);
        Step step;
        step.name = "hint";
        step.bindings = {{0, hint, Access::write}};
        p.step(step);
        p.output(Role::hint, hint);
    }
};

class CarriesHint : public Copy {
    RoleUse roles() const override {
        return {{Role::color, Role::inverse_depth}, {}, {}, {Role::hint}};
    }
    void plan(PassPlanner& p) const override {
        Copy::plan(p);
        if (!p.has(Role::hint) || !p.wanted(Role::hint)) return;
        const auto& frame = p.context().frame;
        const TextureId hint = p.texture("hint", Format::rg16f, frame.width, frame.height);
        Step step;
        step.name = "carry";
        step.bindings = {{0, p.input(Role::hint), Access::sample_nearest},
                         {1, p.input(Role::inverse_depth), Access::sample_nearest},
                         {0, hint, Access::write}};
        p.step(step);
        p.output(Role::hint, hint);
    }
};

// Adds a step whose result only `keeps` has a reader for, and says why.
class Spare : public Copy {
    void plan(PassPlanner& p) const override {
        const TextureId spare = p.texture("spare", Format::r32f, 10, 10);
        Step step;
        step.name = "spare";
        step.bindings = {{0, p.input(Role::motion), Access::sample_nearest},
                         {0, spare, Access::write}};
        step.taps = 100;
        p.step(step);
        p.unused("spare", {"not asked for"});
        Copy::plan(p);
    }
    RoleUse roles() const override { return {{Role::color, Role::motion}, {}, {}, {}}; }
};

class ReadsHint : public Copy {
    RoleUse roles() const override { return {{Role::color}, {Role::hint}, {}, {}}; }
    void add_inputs(PassPlanner& p, Step& step) const override {
        if (p.has(Role::hint))
            step.bindings.push_back({1, p.input(Role::hint), Access::sample_nearest});
    }
};

class ReadsBefore : public Copy {
    RoleUse roles() const override {
        return {{Role::color}, {Role::color_before, Role::motion_before}, {}, {}};
    }
    void add_inputs(PassPlanner& p, Step& step) const override {
        if (p.has(Role::color_before))
            step.bindings.push_back({1, p.input(Role::color_before), Access::sample_nearest});
    }
};

class Blur : public Copy {
    Reach reach(const FrameDescription&) const override { return {20, 20}; }
};

template <class P>
PassType type_of(const char* name) {
    return {name, name, "test", &table(), [] { return std::make_unique<P>(); }, {}};
}

const PassRegistry& registry() {
    static const PassRegistry made({type_of<Copy>("copy"), type_of<Blur>("blur"),
                                    type_of<MakesHint>("makes"), type_of<CarriesHint>("carries"),
                                    type_of<ReadsHint>("reads"), type_of<Spare>("spare"),
                                    type_of<ReadsBefore>("before")});
    return made;
}

Chain chain_of(std::initializer_list<const char*> names) {
    Chain chain;
    for (const char* name : names) chain.append(registry(), name);
    return chain;
}

FrameDescription frame() {
    FrameDescription f;
    f.width = f.display_width = 40;
    f.height = f.display_height = 30;
    f.planes = {Role::color, Role::inverse_depth, Role::motion};
    return f;
}

Plan plan_of(const Chain& chain, const PlanOptions& options = {}) {
    auto plan = make_plan(chain, frame(), options);
    EXPECT_TRUE(plan.ok()) << plan.status().message();
    return plan.ok() ? *plan : Plan();
}

std::vector<std::string> steps_of(const Plan& plan) {
    std::vector<std::string> names;
    for (const auto& step : plan.steps)
        names.push_back(std::to_string(step.pass) + "." + step.name);
    return names;
}

TEST(Planner, StepsRunInChainOrder) {
    EXPECT_THAT(steps_of(plan_of(chain_of({"copy", "copy"}))),
                ElementsAre("0.first", "0.second", "1.first", "1.second"));
}

TEST(Planner, IsPureAndComparesEqual) {
    const Chain chain = chain_of({"makes", "carries", "reads"});
    EXPECT_EQ(plan_of(chain), plan_of(chain));
    EXPECT_EQ(plan_of(chain).hash(), plan_of(chain.clone()).hash());
    EXPECT_NE(plan_of(chain).hash(), plan_of(chain_of({"makes", "reads"})).hash());
}

TEST(Planner, HintExistsOnlyWhenSomebodyReadsIt) {
    EXPECT_THAT(steps_of(plan_of(chain_of({"makes"}))), ElementsAre("0.first", "0.second"));
    EXPECT_THAT(steps_of(plan_of(chain_of({"makes", "reads"}))),
                ElementsAre("0.first", "0.second", "0.hint", "1.first", "1.second"));
    // A reader before the maker reads nothing.
    EXPECT_THAT(steps_of(plan_of(chain_of({"reads", "makes"}))),
                ElementsAre("0.first", "0.second", "1.first", "1.second"));
}

TEST(Planner, HintIsCarriedByAPassInBetween) {
    const Plan plan = plan_of(chain_of({"makes", "carries", "reads"}));
    EXPECT_THAT(steps_of(plan), ElementsAre("0.first", "0.second", "0.hint", "1.first", "1.second",
                                            "1.carry", "2.first", "2.second"));
    // The reader sees the carried plane, not the first one.
    bool reads_carried = false;
    for (const auto& binding : plan.steps[6].bindings)
        reads_carried |= plan.textures[size_t(binding.texture)].name == "1.carries.hint";
    EXPECT_TRUE(reads_carried);
    EXPECT_THAT(steps_of(plan_of(chain_of({"makes", "carries"}))),
                ElementsAre("0.first", "0.second", "1.first", "1.second"));
}

TEST(Planner, ReaderThatIsLeftOutWantsNoHint) {
    Chain chain = chain_of({"makes", "reads"});
    ASSERT_TRUE(table().set(chain.links[1].pass->parameters(), "off", true).ok());
    const Plan plan = plan_of(chain);
    EXPECT_THAT(steps_of(plan), ElementsAre("0.first", "0.second"));
    ASSERT_FALSE(plan.elisions.empty());
    // scratch 40*30*8 and out 40*30*16.
    EXPECT_EQ(plan.elisions[0], (Elision{.pass = 1,
                                         .rule = kRuleConfiguration,
                                         .fact = {.name = "off", .value = 1},
                                         .saving = {28800, 2, 3}}));
}

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
    const Plan half = *make_plan(chain_of({"before"}), f, {.precision = Precision::fp16});
    for (const auto& texture : half.textures)
        if (texture.imported)
            EXPECT_EQ(texture.format, plane_format(channels_of(texture.role), Precision::fp32))
                << texture.name;
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
    EXPECT_THAT(plan_as_json(plan),
                HasSubstr(R"("missing_neighbors":{"before":"frame 0 is not on disk"})"));
    ASSERT_TRUE(table().set(chain.links[1].pass->parameters(), "off", true).ok());
    EXPECT_TRUE(make_plan(chain, f)->missing_neighbors.empty());
}

TEST(Role, OfANeighborHasTheNameAndTheChannelsOfItsOwnFrame) {
    RoleSet all;
    for (Role role : kAllRoles) all.add(role);
    for (Neighbor neighbor : kNeighbors) {
        for (Role role : kFileRoles) {
            const Role there = role_of(neighbor, role);
            EXPECT_EQ(name_of(there), concat(name_of(role), "_", name_of(neighbor)));
            EXPECT_EQ(channels_of(there), channels_of(role));
            EXPECT_EQ((RoleSet{Role::hint, there}).of(neighbor), RoleSet{role});
            all.remove(there);
        }
    }
    for (Role role : kFileRoles) all.remove(role);
    EXPECT_EQ(all, RoleSet{Role::hint});
}

TEST(Planner, RulesCanBeSwitchedOffTogetherOrByName) {
    Chain chain = chain_of({"copy"});
    ASSERT_TRUE(table().set(chain.links[0].pass->parameters(), "off", true).ok());
    EXPECT_TRUE(plan_of(chain).steps.empty());
    PlanOptions all;
    all.elide = false;
    EXPECT_EQ(plan_of(chain, all).steps.size(), 2u);
    PlanOptions one;
    one.rules_off = {kRuleConfiguration};
    EXPECT_EQ(plan_of(chain, one).steps.size(), 2u);
    one.rules_off = {kRuleFacts};
    EXPECT_TRUE(plan_of(chain, one).steps.empty());
}

TEST(Planner, ChainWithoutWorkHandsItsInputOn) {
    const Plan plan = plan_of(chain_of({}));
    EXPECT_TRUE(plan.steps.empty());
    ASSERT_EQ(plan.outputs.count(Role::color), 1u);
    EXPECT_TRUE(plan.textures[size_t(plan.outputs.at(Role::color))].imported);
    EXPECT_TRUE(plan.reads.empty());
}

TEST(Planner, MissingPlaneNamesPassAndWhatThereIs) {
    FrameDescription f = frame();
    f.planes = {Role::color, Role::inverse_depth};
    const auto plan = make_plan(chain_of({"copy", "makes"}), f);
    ASSERT_FALSE(plan.ok());
    EXPECT_EQ(plan.status().code(), StatusCode::input);
    EXPECT_EQ(plan.status().message(),
              "passes[1].makes: needs motion; the frame has color, inverse_depth");
}

TEST(Planner, PlanesNobodyReadsAreLeftOut) {
    const Plan plan = plan_of(chain_of({"copy"}));
    EXPECT_EQ(plan.reads, RoleSet{Role::color});
    std::vector<std::string> unread;
    for (const auto& left : plan.elisions)
        if (left.rule == std::string(kRuleUnusedPlane)) unread.push_back(item_text(left, plan));
    EXPECT_THAT(unread, ElementsAre("input.inverse_depth", "input.motion"));
}

TEST(Planner, StepsThatNothingReadsAreLeftOutWithTheirSaving) {
    const Plan plan = plan_of(chain_of({"spare"}));
    EXPECT_THAT(steps_of(plan), ElementsAre("0.first", "0.second"));
    EXPECT_EQ(plan.reads, RoleSet{Role::color});
    ASSERT_GE(plan.elisions.size(), 1u);
    EXPECT_EQ(plan.elisions[0], (Elision{.pass = 0,
                                         .kind = ElisionKind::step,
                                         .item = "spare",
                                         .rule = kRuleUnusedStep,
                                         .fact = {"not asked for"},
                                         .saving = {400, 1, 100}}));
    for (const auto& texture : plan.textures) EXPECT_NE(texture.name, "0.spare.spare");
    PlanOptions off;
    off.rules_off = {kRuleUnusedStep};
    EXPECT_THAT(steps_of(plan_of(chain_of({"spare"}), off)),
                ElementsAre("0.spare", "0.first", "0.second"));
}

// Only the hint is asked for: what makes color behind it has no reader.
TEST(Planner, WhatNobodyReadsIsLeftOutFromTheEnd) {
    PlanOptions hint_alone;
    hint_alone.outputs = {Role::hint};
    const Plan plan = plan_of(chain_of({"makes", "copy"}), hint_alone);
    EXPECT_THAT(steps_of(plan), ElementsAre("0.hint"));
    EXPECT_TRUE(plan.passes[1].elided);
    EXPECT_FALSE(plan.passes[0].elided);
    size_t unread = 0;
    for (const auto& left : plan.elisions) unread += left.rule == kRuleUnusedOutput;
    EXPECT_EQ(unread, 4u);
    hint_alone.rules_off = {kRuleUnusedOutput};
    EXPECT_EQ(plan_of(chain_of({"makes", "copy"}), hint_alone).steps.size(), 5u);
}

TEST(Planner, HintIsMadeForNobodyWhereTheRuleIsOff) {
    PlanOptions off;
    off.rules_off = {kRuleUnusedStep, kRuleUnusedOutput};
    EXPECT_THAT(steps_of(plan_of(chain_of({"makes"}), off)),
                ElementsAre("0.first", "0.second", "0.hint"));
}

TEST(Planner, PassThatLacksAPlaneIsLeftOutWhenAskedFor) {
    FrameDescription f = frame();
    f.planes = {Role::color};
    f.not_converted = {Role::inverse_depth};
    PlanOptions asked;
    asked.rules_on = {kRuleMissingPlane};
    const auto plan = make_plan(chain_of({"copy", "makes"}), f, asked);
    ASSERT_TRUE(plan.ok()) << plan.status().message();
    EXPECT_THAT(steps_of(*plan), ElementsAre("0.first", "0.second"));
    EXPECT_EQ(plan->elisions[0],
              (Elision{.pass = 1,
                       .rule = kRuleMissingPlane,
                       .fact = {"needs motion; the frame has color, inverse_depth"}}));
    asked.elide = false;
    EXPECT_FALSE(make_plan(chain_of({"copy", "makes"}), f, asked).ok());
    // A pass that is off does without.
    Chain chain = chain_of({"makes"});
    ASSERT_TRUE(table().set(chain.links[0].pass->parameters(), "off", true).ok());
    const auto off = make_plan(chain, f);
    ASSERT_TRUE(off.ok()) << off.status().message();
    EXPECT_EQ(off->elisions[0].rule, kRuleConfiguration);
}

// What was not even decoded is listed, and what a pass that is off would have done with it is
// computed all the same.
TEST(Planner, PlanesThatWereNotDecodedAreLeftOut) {
    FrameDescription f = frame();
    f.planes = {Role::color};
    f.not_converted = {Role::motion};
    Chain chain = chain_of({"makes"});
    ASSERT_TRUE(table().set(chain.links[0].pass->parameters(), "off", true).ok());
    const auto plan = make_plan(chain, f);
    ASSERT_TRUE(plan.ok());
    ASSERT_EQ(plan->elisions.size(), 2u);
    EXPECT_EQ(plan->elisions[0].saving.dispatches, 2);
    EXPECT_EQ(plan->elisions[1], (Elision{.kind = ElisionKind::plane,
                                          .item = "motion",
                                          .rule = kRuleUnusedPlane,
                                          .fact = {"no step reads it: not converted"},
                                          .saving = {.bytes = 9600}}));
}

// Two passes of one type: each entry says of which.
TEST(Planner, ElisionsNameTheirPass) {
    Chain chain = chain_of({"spare", "copy", "spare"});
    ASSERT_TRUE(table().set(chain.links[1].pass->parameters(), "off", true).ok());
    const Plan plan = plan_of(chain);
    std::vector<int> passes;
    std::vector<std::string> items;
    for (const auto& elision : plan.elisions) {
        if (elision.kind == ElisionKind::plane) continue;
        passes.push_back(elision.pass);
        items.push_back(item_text(elision, plan));
    }
    EXPECT_THAT(passes, ElementsAre(1, 0, 2));
    EXPECT_THAT(items, ElementsAre("copy", "passes[0].spare.spare", "passes[2].spare.spare"));
    EXPECT_NE(plan.elisions[1], plan.elisions[2]);
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

TEST(Planner, PlanesAreHandedOverWhereTheRuleIsOff) {
    PlanOptions off;
    off.rules_off = {kRuleUnusedPlane};
    EXPECT_EQ(plan_of(chain_of({"copy"}), off).reads, frame().planes);
}

TEST(Planner, RulesInUse) {
    PassType type = type_of<Copy>("copy");
    type.rules = {{"still", true, "what is still"}, {"alike", false, "what is alike"}};
    const PassRegistry with_rules({type, type_of<Spare>("spare")});
    Chain chain;
    chain.append(with_rules, "spare");
    PlanOptions options;
    // Those of the passes in the chain, and of no other.
    EXPECT_EQ(options.rules(chain).count("still"), 0u);
    chain.append(with_rules, "copy");
    EXPECT_EQ(
        options.rules(chain),
        (std::set<std::string>{kRuleConfiguration, kRuleFacts, kRuleCameraCut, kRuleUnusedPlane,
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
    // Where no block was found nothing was left out.
    const std::vector<WorkDone> none = {{"0.p.still", 0, 12}, {"0.p.needed", 12, 12}};
    EXPECT_FALSE(found_in(still, plan, none));
    EXPECT_FALSE(found_in(unread, plan, none));
    EXPECT_THAT(plan_as_text(plan), HasSubstr("(saves 10 taps a block; the device finds them)"));
}

TEST(Planner, LifetimesAndPeakByHand) {
    // Steps 0..3; textures: input 0..0 (16 B/px), scratch0 0..1 (8), out0 1..2 (16),
    // scratch1 2..3 (8), out1 3..3 (16). Alive: 24, 24, 24, 24 bytes per pixel; 1200 pixels.
    const Plan plan = plan_of(chain_of({"copy", "copy"}));
    EXPECT_EQ(plan.peak_bytes(), 24u * 1200u);
    EXPECT_EQ(plan.transient_bytes(), 48u * 1200u);
    for (const auto& texture : plan.textures) {
        if (texture.name == "0.copy.out") {
            EXPECT_EQ(texture.first_step, 1);
            EXPECT_EQ(texture.last_step, 2);
        }
    }
}

TEST(Planner, PrintsNameEverythingThatRunsAndIsLeftOut) {
    Chain chain = chain_of({"makes", "reads", "copy"});
    ASSERT_TRUE(table().set(chain.links[2].pass->parameters(), "off", true).ok());
    const Plan plan = plan_of(chain);
    for (const std::string& text : {plan_as_text(plan), plan_as_json(plan), plan_as_dot(plan)}) {
        EXPECT_THAT(text, HasSubstr("makes"));
        EXPECT_THAT(text, HasSubstr("0.makes.hint"));
        EXPECT_THAT(text, HasSubstr("copy"));
    }
    EXPECT_THAT(plan_as_text(plan), HasSubstr("left out copy [off_by_configuration]: off is 1"));
    EXPECT_THAT(plan_as_dot(plan), HasSubstr("copy\\nleft out"));
    EXPECT_EQ(plan_as_json(plan).find('\n'), std::string::npos);
}

// A pass that a rule elides because the caller asked for it is elided in the reference too.
TEST(Reference, LacksAPassThatMayBeMissing) {
    FramePlanes planes;
    planes[Role::color] = ImageF(1, 1, 4, 3.0f);
    FrameDescription f = frame();
    f.width = f.height = 1;
    f.planes = {Role::color};
    PlanOptions asked;
    asked.rules_on = {kRuleMissingPlane};
    const auto result = run_reference(chain_of({"copy", "makes"}), f, planes, asked);
    ASSERT_TRUE(result.ok()) << result.status().message();
    EXPECT_EQ(result->planes.at(Role::color).data[0], 7.0);
    EXPECT_FALSE(run_reference(chain_of({"copy", "makes"}), f, planes).ok());
}

// Whatever the rules say: a pass that is off is run as it is described.
TEST(Reference, RunsWhatTheRulesElide) {
    FramePlanes planes;
    planes[Role::color] = ImageF(1, 1, 4, 3.0f);
    FrameDescription f = frame();
    f.width = f.height = 1;
    f.planes = {Role::color};
    Chain chain = chain_of({"copy"});
    ASSERT_TRUE(table().set(chain.links[0].pass->parameters(), "off", true).ok());
    for (const bool elide : {true, false}) {
        PlanOptions options;
        options.elide = elide;
        const auto result = run_reference(chain, f, planes, options);
        ASSERT_TRUE(result.ok()) << result.status().message();
        EXPECT_EQ(result->planes.at(Role::color).data[0], 7.0) << elide;
    }
}

TEST(Reference, RunsPassesInOrderAndNamesStagesAsThePlanDoes) {
    FramePlanes planes;
    planes[Role::color] = ImageF(1, 1, 4, 3.0f);
    FrameDescription f = frame();
    f.width = f.height = 1;
    f.planes = {Role::color};
    auto result = run_reference(chain_of({"copy", "copy"}), f, planes);
    ASSERT_TRUE(result.ok());
    // 2 (2*3 + 1) + 1 = 15.
    EXPECT_EQ(result->planes.at(Role::color).data[0], 15.0);
    EXPECT_EQ(result->stages.at("0.copy.scratch").data[0], 7.0);
    EXPECT_EQ(result->stages.at("1.copy.scratch").data[0], 15.0);
}

}  // namespace
}  // namespace postchain
