#include "tests/chain/plan_support.h"

#include <gtest/gtest.h>

#include <array>

#include "tests/support/status.h"

namespace postchain::test {
namespace {

struct Nothing {
    bool off = false;
};

const ParameterTable& off_table() {
    static const ParameterTable made = ParameterTableBuilder<Nothing>()
                                           .boolean("off", &Nothing::off, {.help = "do nothing"})
                                           .table();
    return made;
}

// A pass that copies color through one scratch texture; derived ones change what they use.
class Copy : public PlainPass {
  public:
    RoleUse roles() const override { return {{Role::color}, {}, {}, {}}; }
    Reach reach() const override { return {0, 0}; }
    std::optional<Identity> identity(const PlanContext&) const override {
        if (!parameters_.off) return std::nullopt;
        return Identity{kRuleConfiguration, {.name = "off", .value = 1}};
    }
    void plan(PassPlanner& p) const override {
        const TextureId scratch = p.texture("scratch", Format::rgba16f);
        const TextureId out = p.texture("out", Format::rgba32f);
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
        const TextureId hint = p.texture("hint", Format::rg16f);
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
        const TextureId hint = p.texture("hint", Format::rg16f);
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
        const TextureId spare = p.texture("spare", Format::r32f, Area::fixed(10, 10));
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
    Reach reach() const override { return {20, 20}; }
};

class BlursBefore : public ReadsBefore {
    Reach reach() const override { return {20, 20}; }
};

// A step with a block that write_uniforms() does not fill.
class Forgets : public Copy {
    struct Block {
        static constexpr const char* kName = "Block";
        std::array<float, 4> values;
    };
    void add_inputs(PassPlanner&, Step& step) const override { step.take_uniforms<Block>(); }
};

template <class P>
PassType type_of(const char* name) {
    return {name, name, "test", &off_table(), [] { return std::make_unique<P>(); }, {}};
}

}  // namespace

const PassRegistry& small_passes() {
    static const PassRegistry made(
        {type_of<Copy>("copy"), type_of<Blur>("blur"), type_of<MakesHint>("makes"),
         type_of<CarriesHint>("carries"), type_of<ReadsHint>("reads"), type_of<Spare>("spare"),
         type_of<ReadsBefore>("before"), type_of<BlursBefore>("blur_before"),
         type_of<Forgets>("forgets")});
    return made;
}

Chain chain_of(std::initializer_list<const char*> names) {
    Chain chain;
    for (const char* name : names) chain.append(small_passes(), name);
    return chain;
}

FrameDescription frame() {
    FrameDescription f;
    f.width = f.display_width = 40;
    f.height = f.display_height = 30;
    f.planes = {Role::color, Role::inverse_depth, Role::motion};
    return f;
}

Chain with_off(Chain chain, size_t pass) {
    EXPECT_TRUE(off_table().set(chain.links.at(pass).pass->parameters(), "off", true).ok());
    return chain;
}

Plan plan_of(const Chain& chain, const PlanOptions& options, const FrameDescription& described) {
    return must(make_plan(chain, described, options));
}

std::vector<std::string> steps_of(const Plan& plan) {
    std::vector<std::string> names;
    for (const auto& step : plan.steps)
        names.push_back(std::to_string(step.pass) + "." + step.name);
    return names;
}

}  // namespace postchain::test
