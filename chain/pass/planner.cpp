#include "chain/pass/planner.h"

#include <algorithm>
#include <iterator>

namespace postchain {
namespace {

// Inputs keep full precision: an elided pass must change no bit.
PlanTexture input_texture(Role role, const FrameDescription& frame) {
    PlanTexture texture;
    texture.name = std::string("input.") + name_of(role);
    texture.format = plane_format(channels_of(role), Precision::fp32);
    texture.width = frame.width;
    texture.height = frame.height;
    texture.slices = stacked_planes(role, frame);
    texture.imported = true;
    texture.role = role;
    return texture;
}

using Reasons = PassPlanner::Reasons;

// Removes every step that writes nothing that an output or a later step needs, if its rule is in
// use: unused_step if the pass gave a reason, otherwise unused_output.
void drop_unread_steps(Plan& plan, const Reasons& reasons, const RuleNames& rules) {
    std::vector<char> needed(plan.textures.size(), 0);
    for (const auto& [role, id] : plan.outputs) needed[size_t(id)] = 1;
    std::vector<Step> kept;
    std::vector<Elision> elisions;
    for (size_t i = plan.steps.size(); i-- > 0;) {
        Step& step = plan.steps[i];
        const auto reason = reasons.find({step.pass, step.name});
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

// Planes of the frame that no step reads are not uploaded, or not even converted.
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

// Options without the rules that change no bit: rules that decide what is filtered at all remain.
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

// The cost of an elided pass had it run: the last pass of `plan`. None if a plane is missing that
// it requires.
Saving saving_of(const Plan& plan, std::map<Role, TextureId> current, const Pass& pass,
                 const PassOnFrame& on_frame, const PlanContext& resolved) {
    PlanContext context = resolved;
    for (const Role role : kAllRoles)
        if (!current.contains(role)) context.available.remove(role);
    if (!(pass.roles().required - (context.available | context.frame.not_converted)).empty())
        return {};
    Plan planned;
    planned.passes = plan.passes;
    planned.textures = plan.textures;
    for (Role role : kAllRoles) {
        if (!context.frame.not_converted.has(role)) continue;
        current[role] = TextureId(planned.textures.size());
        planned.textures.push_back(input_texture(role, context.frame));
    }
    const Plan alone = plan_alone(std::move(planned), std::move(current), on_frame, context);
    Saving saving;
    saving.dispatches = int(alone.steps.size());
    saving.bytes = alone.transient_bytes();
    for (const auto& step : alone.steps) saving.taps += step.taps;
    return saving;
}

// Every block that a step of the last pass declares has its bytes.
Status check_uniforms(const Plan& plan) {
    for (const Step& step : plan.steps)
        if (step.pass + 1 == int(plan.passes.size()) && !step.uniforms_type.empty() &&
            step.uniforms.empty())
            return Status(
                StatusCode::internal,
                concat("step ", step.name, ": write_uniforms() sets no ", step.uniforms_type));
    return Status();
}

// Adds the steps of a pass that runs.
Status add_pass(const PassOnFrame& pass, const PlanContext& context, Plan& plan,
                std::map<Role, TextureId>& current, Reasons& reasons) {
    PassPlanner::Target target{plan, current, reasons, int(plan.passes.size()) - 1};
    PassPlanner planner(target, context);
    plan_pass(pass, planner);
    if (!target.status.ok()) return target.status;
    UniformWriter uniforms(plan, target.pass);
    write_uniforms(pass, context, uniforms);
    return check_uniforms(plan);
}

// Neighbors that a pass which runs could have used, and why they are missing.
void find_missing_neighbors(const ResolvedChain& resolved, Plan& plan) {
    const auto& links = resolved.chain().links;
    const size_t spreading = resolved.first_spreading_pass();
    const FrameDescription& frame = resolved.frame();
    for (size_t i = 0; i < links.size(); ++i) {
        const RoleUse use = links[i].pass->roles();
        for (const Neighbor neighbor : kNeighbors) {
            if (plan.passes[i].elided || (use.required | use.optional).of(neighbor).empty())
                continue;
            if (const auto why = frame.missing_neighbors.find(neighbor);
                why != frame.missing_neighbors.end())
                plan.missing_neighbors[neighbor] = why->second;
            else if (i > spreading && !frame.planes.of(neighbor).empty())
                plan.missing_neighbors[neighbor] =
                    concat(links[i].type->name, " stands after ", links[spreading].type->name,
                           ", which that frame's color has not been through");
        }
    }
}

std::vector<RoleSet> subsets_of(RoleSet roles) {
    std::vector<RoleSet> subsets = {{}};
    for (const Role role : kAllRoles) {
        if (!roles.has(role)) continue;
        const size_t without = subsets.size();
        for (size_t i = 0; i < without; ++i) subsets.push_back(subsets[i] | RoleSet{role});
    }
    return subsets;
}

// A plan with the frame's planes and nothing else.
Plan empty_plan(const FrameDescription& frame, RoleSet planes, std::map<Role, TextureId>& current) {
    Plan plan;
    for (const Role role : kAllRoles) {
        if (!planes.has(role)) continue;
        current[role] = TextureId(plan.textures.size());
        plan.textures.push_back(input_texture(role, frame));
    }
    return plan;
}

// A macro takes the qualifier out of the program's text.
void choose_math(ProgramKey& program, const PlanOptions& options) {
    if (options.fast_math) program.defines["precise"] = "";
}

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

Result<Plan> make_plan(const Chain& chain, const FrameDescription& frame,
                       const PlanOptions& options) {
    const RuleNames rules = options.rules(chain);
    ResolvedChain resolved;
    RETURN_IF_ERROR(resolved.resolve(chain, frame, options, rules));
    return make_plan(resolved);
}

Result<Plan> make_plan(const ResolvedChain& resolved) {
    const Chain& chain = resolved.chain();
    const FrameDescription& frame = resolved.frame();
    std::map<Role, TextureId> current;
    Plan plan = empty_plan(frame, frame.planes, current);
    plan.frame_number = frame.frame_number;
    plan.width = frame.width;
    plan.height = frame.height;
    plan.precision = resolved.options().precision;
    plan.chain_hash = chain.hash();
    for (const auto& link : chain.links)
        for (const Place& place : link.pass->depth_places())
            if (const auto found = frame.bounds.inverse_depth_at.find(place);
                found != frame.bounds.inverse_depth_at.end())
                plan.inverse_depth_at.insert(*found);

    Reasons reasons;
    for (size_t i = 0; i < chain.links.size(); ++i) {
        const ChainLink& link = chain.links[i];
        const auto& [pass, identity] = resolved.links()[i];
        const PlanContext context = resolved.context(i);
        const RoleUse use = link.pass->roles();
        plan.passes.push_back(
            {link.type->name, link.values_text(), identity.has_value(), pass->tile_edge()});
        if (!identity) {
            if (Status s = add_pass(*pass, context, plan, current, reasons); !s.ok())
                return s.at(concat("passes[", i, "].", link.type->name));
            continue;
        }
        Elision elision;
        elision.pass = int(i);
        elision.rule = identity->rule;
        elision.fact = identity->rule == kRuleMissingPlane
                           ? Fact{missing_text(*link.pass, context.available, frame)}
                           : identity->fact.fact();
        elision.saving = saving_of(plan, current, *link.pass, *pass, context);
        plan.elisions.push_back(std::move(elision));
        for (Role role : kAllRoles)
            if (use.on_demand.has(role)) current.erase(role);
    }
    const RoleSet wanted_outputs = outputs_of(resolved.frame(), resolved.options());
    for (Role role : kAllRoles)
        if (wanted_outputs.has(role) && current.count(role)) plan.outputs[role] = current[role];
    drop_unread_steps(plan, reasons, resolved.rules());
    drop_untouched_textures(plan);
    std::vector<TextureId> outputs;
    for (const auto& [role, id] : plan.outputs) outputs.push_back(id);
    find_lifetimes(plan, outputs);
    drop_unread_planes(plan, frame, wanted_outputs, resolved.rules());
    find_missing_neighbors(resolved, plan);
    for (Step& step : plan.steps) choose_math(step.program, resolved.options());
    return plan;
}

Plan plan_alone(Plan plan, std::map<Role, TextureId> current, const PassOnFrame& pass,
                const PlanContext& context) {
    for (auto& texture : plan.textures) texture.imported = true;
    Reasons reasons;
    PassPlanner::Target target{plan, current, reasons, int(plan.passes.size()) - 1};
    PassPlanner planner(target, context);
    pass.plan(planner);
    for (const auto& [role, id] : current) plan.outputs[role] = id;
    drop_unread_steps(plan, reasons, context.rules);
    drop_untouched_textures(plan);
    return plan;
}

std::vector<ProgramKey> programs_of(const Chain& chain, const FrameDescription& given,
                                    const PlanOptions& options) {
    const FrameDescription frame = seen_by(chain, given);
    const RuleNames rules = options.rules(chain);
    const bool drops_unwanted = rules.contains(kRuleUnusedStep);
    std::vector<ProgramKey> programs;
    const auto add = [&](const Plan& plan) {
        for (const Step& step : plan.steps) {
            ProgramKey program = step.program;
            choose_math(program, options);
            if (std::find(programs.begin(), programs.end(), program) == programs.end())
                programs.push_back(std::move(program));
        }
    };
    RoleSet made;  // by earlier passes, those that run
    for (size_t i = 0; i < chain.links.size(); ++i) {
        const ChainLink& link = chain.links[i];
        const RoleUse use = link.pass->roles();
        const std::vector<ResolvedPass> shapes = every_shape(chain, i, frame);
        const RoleSet readable = outputs_of(frame, options) | readable_after(chain, i);
        const RoleSet may_be_wanted =
            drops_unwanted ? readable & (use.on_demand | use.carried) : RoleSet();
        const RoleSet always = drops_unwanted ? readable - may_be_wanted : kEveryRole;
        for (const RoleSet exists : subsets_of(made)) {
            const RoleSet all = (frame.planes - made) | exists;
            // After a pass that spreads color there are no neighbors.
            for (const RoleSet available : {all, i > 0 ? without_neighbors(all) : all}) {
                if (!(use.required - available).empty()) continue;
                for (const RoleSet wanted : subsets_of(may_be_wanted)) {
                    const PlanContext context = {
                        frame, options.precision, available, always | wanted, false,
                        rules, options.device};
                    std::map<Role, TextureId> current;
                    Plan plan = empty_plan(frame, frame.planes | available, current);
                    plan.passes.push_back({link.type->name, "", false, {}});
                    for (const ResolvedPass& pass : shapes)
                        add(plan_alone(plan, current, *pass, context));
                }
            }
        }
        made = made | use.on_demand;
    }
    return programs;
}

Result<ReferenceFrame> run_reference(const Chain& chain, const FrameDescription& frame,
                                     PlaneView planes, const PlanOptions& options) {
    const PlanOptions whole = whole_passes_of(chain, options);
    const RuleNames rules = whole.rules(chain);
    ResolvedChain resolved;
    RETURN_IF_ERROR(resolved.resolve(chain, frame, whole, rules));
    ReferenceFrame result;
    for (const auto& [role, plane] : planes) result.planes[role] = image_cast<double>(*plane);
    for (size_t i = 0; i < chain.links.size(); ++i) {
        const ResolvedChain::Link& link = resolved.links()[i];
        if (link.identity) continue;
        ReferenceFrame one;
        one.planes = std::move(result.planes);
        link.pass->reference(resolved.context(i), one);
        result.planes = std::move(one.planes);
        for (auto& [name, stage] : one.stages)
            result.stages[concat(i, ".", chain.links[i].type->name, ".", name)] = std::move(stage);
    }
    return result;
}

}  // namespace postchain
