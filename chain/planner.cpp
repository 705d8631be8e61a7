#include "chain/planner.h"

#include <algorithm>
#include <cassert>
#include <iterator>
#include <span>

#include "chain/decisions.h"
#include "chain/hold_still.h"
#include "chain/matte.h"

namespace postchain {
namespace {

// Inputs keep full precision: a pass left out must change no bit.
PlanTexture input_texture(Role role, const FrameDescription& frame) {
    PlanTexture texture;
    texture.name = std::string("input.") + name_of(role);
    texture.format = plane_format(channels_of(role), Precision::fp32);
    texture.width = frame.width;
    texture.height = frame.height;
    texture.layers = stacked_planes(role, frame);
    texture.imported = true;
    texture.role = role;
    return texture;
}

// Why nothing reads what a step writes, by "<index of the pass>.<step>".
using Reasons = std::map<std::string, Fact>;

// Records one pass's work at the end of a plan.
class Recorder final : public PassPlanner {
  public:
    Recorder(Plan& plan, std::map<Role, TextureId>& current, Reasons& reasons,
             const PlanContext& context, int pass, std::string type)
        : plan_(plan),
          current_(current),
          reasons_(reasons),
          context_(context),
          pass_(pass),
          type_(std::move(type)) {}

    const PlanContext& context() const override { return context_; }
    TextureId input(Role role) const override { return current_.at(role); }
    TextureId texture(const std::string& name, Format format, int width, int height) override {
        PlanTexture texture;
        texture.name = concat(pass_, ".", type_, ".", name);
        texture.format = format;
        texture.width = width;
        texture.height = height;
        plan_.textures.push_back(texture);
        return TextureId(plan_.textures.size()) - 1;
    }
    TextureId layers(const std::string& name, Format format, int width, int height) override {
        const TextureId id = texture(name, format, width, height);
        plan_.textures[size_t(id)].layers = context_.frame.layers;
        return id;
    }
    int frame_number() override {
        plan_.uses_frame_number = true;
        return context_.frame.frame_number;
    }
    const PlanTexture& describe(TextureId texture) const override {
        return plan_.textures[size_t(texture)];
    }
    void step(Step step) override {
        step.pass = pass_;
        plan_.steps.push_back(std::move(step));
    }
    void output(Role role, TextureId texture) override { current_[role] = texture; }
    void unused(const std::string& step, Fact why) override {
        reasons_[concat(pass_, ".", step)] = std::move(why);
    }
    void elide(Elision elision) override {
        elision.pass = pass_;
        plan_.elisions.push_back(std::move(elision));
    }

  private:
    Plan& plan_;
    std::map<Role, TextureId>& current_;
    Reasons& reasons_;
    const PlanContext& context_;
    int pass_;
    std::string type_;
};

// Takes out every step that writes nothing that an output or a later step needs, if its rule is in
// use: unused_step where the pass gave a reason, unused_output elsewhere.
void drop_unread_steps(Plan& plan, const Reasons& reasons, const RuleNames& rules) {
    std::vector<char> needed(plan.textures.size(), 0);
    for (const auto& [role, id] : plan.outputs) needed[size_t(id)] = 1;
    std::vector<Step> kept;
    std::vector<Elision> elisions;
    for (size_t i = plan.steps.size(); i-- > 0;) {
        Step& step = plan.steps[i];
        const auto reason = reasons.find(concat(step.pass, ".", step.name));
        const char* rule = reason == reasons.end() ? kRuleUnusedOutput : kRuleUnusedStep;
        bool keep = rules.count(rule) == 0;
        for (const auto& binding : step.bindings)
            keep = keep || (step.writes(binding) && needed[size_t(binding.texture)]);
        if (keep) {
            for (const auto& binding : step.bindings) needed[size_t(binding.texture)] = 1;
            kept.push_back(std::move(step));
            continue;
        }
        Elision elision;
        elision.pass = step.pass;
        elision.kind = ElisionKind::step;
        elision.item = step.name;
        elision.rule = rule;
        elision.fact =
            reason == reasons.end() ? Fact{"no step reads what it writes"} : reason->second;
        elision.saving.dispatches = 1;
        elision.saving.taps = step.taps;
        for (const auto& binding : step.bindings)
            if (step.writes(binding))
                elision.saving.bytes += plan.textures[size_t(binding.texture)].bytes();
        elisions.push_back(std::move(elision));
    }
    plan.steps.assign(std::make_move_iterator(kept.rbegin()), std::make_move_iterator(kept.rend()));
    plan.elisions.insert(plan.elisions.end(), elisions.rbegin(), elisions.rend());
    // A pass without a step left hands nothing on: it is elided as a whole.
    for (size_t pass = 0; pass < plan.passes.size(); ++pass) {
        bool works = false;
        for (const auto& step : plan.steps) works = works || step.pass == int(pass);
        plan.passes[pass].elided = !works;
    }
}

// Forgets the textures that no step touches.
void drop_untouched_textures(Plan& plan) {
    std::vector<char> touched(plan.textures.size(), 0);
    for (const auto& step : plan.steps)
        for (const auto& binding : step.bindings) touched[size_t(binding.texture)] = 1;
    std::vector<TextureId> renamed(plan.textures.size(), -1);
    std::vector<PlanTexture> textures;
    for (size_t i = 0; i < plan.textures.size(); ++i) {
        if (!touched[i] && !plan.textures[i].imported) continue;
        renamed[i] = TextureId(textures.size());
        textures.push_back(std::move(plan.textures[i]));
    }
    plan.textures = std::move(textures);
    for (auto& step : plan.steps) {
        for (auto& binding : step.bindings) binding.texture = renamed[size_t(binding.texture)];
        if (step.work_list >= 0) step.work_list = renamed[size_t(step.work_list)];
    }
    for (auto& elision : plan.elisions)
        if (elision.work_list >= 0) elision.work_list = renamed[size_t(elision.work_list)];
    for (auto& [role, id] : plan.outputs) id = renamed[size_t(id)];
}

// Planes that the frame has and no step reads are not handed over, or not even converted.
void drop_unread_planes(Plan& plan, const FrameDescription& frame, RoleSet outputs,
                        const RuleNames& rules) {
    const auto elide = [&](const PlanTexture& plane, const char* why) {
        Elision elision;
        elision.kind = ElisionKind::plane;
        elision.item = name_of(plane.role);
        elision.rule = kRuleUnusedPlane;
        elision.fact.name = why;
        elision.saving.bytes = plane.bytes();
        plan.elisions.push_back(std::move(elision));
    };
    for (Role role : kAllRoles)
        if (frame.not_converted.has(role))
            elide(input_texture(role, frame), "no step reads it: not converted");
    for (const auto& texture : plan.textures) {
        if (!texture.imported) continue;
        if (texture.first_step >= 0 || rules.count(kRuleUnusedPlane) == 0)
            plan.reads.add(texture.role);
        else if (!outputs.has(texture.role))
            elide(texture, "no step reads it");
    }
}

// Without the rules that change no bit: those that decide what is filtered at all remain.
PlanOptions whole_passes_of(const Chain& chain, const PlanOptions& options) {
    const RuleNames rules = options.rules(chain);
    PlanOptions whole = options;
    whole.elide = true;
    for (const auto& name : PlanOptions().rules(chain)) whole.rules_off.insert(name);
    whole.rules_on.clear();
    if (rules.count(kRuleCameraCut)) whole.rules_off.erase(kRuleCameraCut);
    if (rules.count(kRuleMissingPlane)) whole.rules_on.insert(kRuleMissingPlane);
    return whole;
}

// What an elided pass would have cost: the last pass of `plan`.
Saving saving_of(const Plan& plan, std::map<Role, TextureId> current, const PlanContext& context,
                 const Pass& pass) {
    Plan whole;
    whole.passes = plan.passes;
    whole.textures = plan.textures;
    for (auto& texture : whole.textures) texture.imported = true;
    for (Role role : kAllRoles) {
        if (!context.frame.not_converted.has(role)) continue;
        current[role] = TextureId(whole.textures.size());
        whole.textures.push_back(input_texture(role, context.frame));
    }
    Reasons reasons;
    Recorder recorder(whole, current, reasons, context, int(plan.passes.size()) - 1,
                      plan.passes.back().type);
    pass.plan(recorder);
    for (const auto& [role, id] : current) whole.outputs[role] = id;
    drop_unread_steps(whole, reasons, context.rules);
    drop_untouched_textures(whole);
    Saving saving;
    saving.dispatches = int(whole.steps.size());
    saving.bytes = whole.transient_bytes();
    for (const auto& step : whole.steps) saving.taps += step.taps;
    return saving;
}

// A pass that hands on another color must hand on other layers too.
Status check_layers(const std::map<Role, TextureId>& before,
                    const std::map<Role, TextureId>& after) {
    const auto layers = before.find(Role::layers);
    if (layers == before.end() || after.at(Role::color) == before.at(Role::color) ||
        after.at(Role::layers) != layers->second)
        return Status();
    return Status(StatusCode::chain,
                  "filters color alone, and this frame has further layers; leave the layers or the "
                  "pass out (of a new pass: docs/adding_a_pass.md says what filters them)");
}

// What stood in the place of these planes for one pass gives way to them again.
template <class Roles, class Planes>
void restore(const Roles& roles, const Planes& before, Planes& current) {
    for (const Role role : roles) {
        current.erase(role);
        if (const auto found = before.find(role); found != before.end()) current.insert(*found);
    }
}

class PlanUniforms final : public UniformWriter {
  public:
    PlanUniforms(Plan& plan, int pass) : plan_(plan), pass_(pass) {}

  private:
    void write(std::string_view name, std::string_view type,
               std::span<const std::byte> bytes) override {
        for (Step& step : plan_.steps) {
            if (step.pass != pass_ || step.uniforms_type != type) continue;
            if (!name.empty() && step.name != name) continue;
            assert(step.uniforms.size() == bytes.size());
            std::copy(bytes.begin(), bytes.end(), step.uniforms.begin());
        }
    }

    Plan& plan_;
    int pass_;
};

}  // namespace

bool PlanOptions::uses(const ElisionRule& rule) const {
    return elide &&
           (rule.on_by_default ? rules_off.count(rule.name) == 0 : rules_on.count(rule.name) > 0);
}

RuleNames PlanOptions::rules(const Chain& chain) const {
    RuleNames names;
    const auto add = [&](const std::vector<ElisionRule>& rules) {
        for (const auto& rule : rules)
            if (uses(rule)) names.insert(rule.name);
    };
    add(chain_rules());
    for (const auto& link : chain.links) add(link.type->rules);
    return names;
}

Result<Plan> make_plan(const Chain& chain, const FrameDescription& given,
                       const PlanOptions& options) {
    const FrameDescription frame = seen_by(chain, given);
    const RoleSet wanted_outputs = outputs_of(options, frame);
    const RuleNames rules = options.rules(chain);
    PlanShape shape;
    std::vector<Reason> reasons_elided;
    if (Status s = decide(chain, frame, options, rules, shape, &reasons_elided); !s.ok()) return s;

    Plan plan;
    plan.frame_number = frame.frame_number;
    plan.width = frame.width;
    plan.height = frame.height;
    plan.precision = options.precision;
    plan.chain_hash = chain.hash();
    for (const auto& link : chain.links)
        for (const Place& place : link.pass->depth_places())
            if (const auto found = frame.bounds.inverse_depth_at.find(place);
                found != frame.bounds.inverse_depth_at.end())
                plan.inverse_depth_at.insert(*found);
    std::map<Role, TextureId> current;
    for (Role role : kAllRoles) {
        if (!frame.planes.has(role)) continue;
        current[role] = TextureId(plan.textures.size());
        plan.textures.push_back(input_texture(role, frame));
    }

    Reasons reasons;
    for (size_t i = 0; i < chain.links.size(); ++i) {
        const PassType* type = chain.links[i].type;
        const auto& pass = chain.links[i].pass;
        const PlanShape::OfPass& decided = shape.passes[i];
        const PlanContext context = context_of(frame, options, rules, decided);
        plan.passes.push_back({type->name, chain.links[i].values_text(), decided.elided});
        const auto seen = decided.elided ? std::nullopt : seen_with_matte(chain, frame, i);
        if (seen && chain.links[i].keeps_still()) {
            const std::map<Role, TextureId> before = current;
            const PlanContext still_context = context_of(*seen, options, rules, decided);
            Recorder recorder(plan, current, reasons, still_context, int(i), type->name);
            hold_still(recorder, matte_of(frame, i));
            pass->plan(recorder);
            if (Status s = check_layers(before, current); !s.ok())
                return s.at(concat("passes[", i, "].", type->name));
            restore(kStillRoles, before, current);
            continue;
        }
        if (seen) {
            const int matte = matte_of(frame, i);
            const std::map<Role, TextureId> before = current;
            const PlanContext held_context = context_of(*seen, options, rules, decided);
            Recorder holding(plan, current, reasons, held_context, int(i), type->name);
            hold_out(holding, matte, frame.layers);
            const std::map<Role, TextureId> held_planes = current;
            pass->plan(holding);
            if (Status s = check_layers(held_planes, current); !s.ok())
                return s.at(concat("passes[", i, "].", type->name));
            const Matted filtered = {before.at(Role::color), current.at(Role::color),
                                     held_planes.at(Role::layers), current.at(Role::layers),
                                     before.count(Role::layers) ? before.at(Role::layers) : -1};
            restore(kHeldRoles, before, current);
            Recorder laying(plan, current, reasons, context, int(i), type->name);
            lay_over(laying, matte, filtered);
            continue;
        }
        if (!decided.elided) {
            const std::map<Role, TextureId> before = current;
            Recorder recorder(plan, current, reasons, context, int(i), type->name);
            pass->plan(recorder);
            if (Status s = check_layers(before, current); !s.ok())
                return s.at(concat("passes[", i, "].", type->name));
            continue;
        }
        Elision elision;
        elision.pass = int(i);
        elision.rule = reasons_elided[i].rule;
        elision.fact = std::move(reasons_elided[i].fact);
        const RoleSet known = decided.available | frame.not_converted;
        if ((pass->roles().required - known).empty())
            elision.saving = saving_of(plan, current, context, *pass);
        plan.elisions.push_back(std::move(elision));
        for (Role role : kAllRoles)
            if (pass->roles().on_demand.has(role)) current.erase(role);
    }
    for (Role role : kAllRoles)
        if (wanted_outputs.has(role) && current.count(role)) plan.outputs[role] = current[role];
    drop_unread_steps(plan, reasons, rules);
    drop_untouched_textures(plan);
    std::vector<TextureId> outputs;
    for (const auto& [role, id] : plan.outputs) outputs.push_back(id);
    find_lifetimes(plan, outputs);
    drop_unread_planes(plan, frame, wanted_outputs, rules);
    const size_t spreading = first_spreading_pass(chain, frame);
    for (size_t i = 0; i < chain.links.size(); ++i) {
        const RoleUse use = chain.links[i].pass->roles();
        for (const Neighbor neighbor : kNeighbors) {
            if (plan.passes[i].elided || (use.required | use.optional).of(neighbor).empty())
                continue;
            if (const auto why = frame.missing_neighbors.find(neighbor);
                why != frame.missing_neighbors.end())
                plan.missing_neighbors[neighbor] = why->second;
            else if (i > spreading && !frame.planes.of(neighbor).empty())
                plan.missing_neighbors[neighbor] = concat(
                    chain.links[i].type->name, " stands after ", chain.links[spreading].type->name,
                    ", which that frame's color has not been through");
        }
    }
    return plan;
}

Status find_shape(const Chain& chain, const FrameDescription& frame, const PlanOptions& options,
                  const RuleNames& rules, PlanShape& shape) {
    return decide(chain, seen_by(chain, frame), options, rules, shape, nullptr);
}

void write_values(const Chain& chain, const FrameDescription& given, const PlanOptions& options,
                  const RuleNames& rules, const PlanShape& shape, Plan& plan) {
    const FrameDescription frame = seen_by(chain, given);
    plan.frame_number = frame.frame_number;
    for (size_t i = 0; i < shape.passes.size(); ++i) {
        if (shape.passes[i].elided) continue;
        PlanUniforms blocks(plan, int(i));
        chain.links[i].pass->values(context_of(frame, options, rules, shape.passes[i]), blocks);
    }
}

Result<ReferenceFrame> run_reference(const Chain& chain, const FrameDescription& given,
                                     PlaneView planes, const PlanOptions& options) {
    const FrameDescription frame = seen_by(chain, given);
    const PlanOptions whole = whole_passes_of(chain, options);
    const RuleNames rules = whole.rules(chain);
    PlanShape shape;
    if (Status s = decide(chain, frame, whole, rules, shape, nullptr); !s.ok()) return s;
    ReferenceFrame result;
    for (const auto& [role, plane] : planes) result.planes[role] = image_cast<double>(*plane);
    for (size_t i = 0; i < chain.links.size(); ++i) {
        if (shape.passes[i].elided) continue;
        ReferenceFrame one;
        one.planes = std::move(result.planes);
        const auto& pass = *chain.links[i].pass;
        const int matte = matte_of(frame, i);
        const auto seen = seen_with_matte(chain, frame, i);
        if (seen && chain.links[i].keeps_still()) {
            const auto before = one.planes;
            hold_still_reference(one.planes, matte);
            pass.reference(context_of(*seen, whole, rules, shape.passes[i]), one);
            restore(kStillRoles, before, one.planes);
        } else if (seen) {
            const auto before = one.planes;
            hold_out_reference(one.planes, matte);
            pass.reference(context_of(*seen, whole, rules, shape.passes[i]), one);
            lay_over_reference(one.planes, before, matte);
            one.stages.clear();  // of the held layers
        } else {
            pass.reference(context_of(frame, whole, rules, shape.passes[i]), one);
        }
        result.planes = std::move(one.planes);
        for (auto& [name, stage] : one.stages)
            result.stages[concat(i, ".", chain.links[i].type->name, ".", name)] = std::move(stage);
    }
    return result;
}

}  // namespace postchain
