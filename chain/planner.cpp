#include "chain/planner.h"

namespace postchain {
namespace {

// Records one pass's work at the end of a plan.
class Recorder final : public PassPlanner {
  public:
    Recorder(Plan& plan, std::map<Role, TextureId>& current, const PlanContext& context, int pass,
             std::string type, bool report)
        : plan_(plan),
          current_(current),
          context_(context),
          pass_(pass),
          type_(std::move(type)),
          report_(report) {}

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
    const PlanTexture& describe(TextureId texture) const override {
        return plan_.textures[size_t(texture)];
    }
    void step(Step step) override {
        step.pass = pass_;
        plan_.steps.push_back(std::move(step));
    }
    void output(Role role, TextureId texture) override { current_[role] = texture; }
    void left_out(const std::string& what, const std::string& reason) override {
        if (report_)
            plan_.left_out.push_back({type_ + "." + what, kRuleUnusedStep, reason, 0, 0, 0});
    }

  private:
    Plan& plan_;
    std::map<Role, TextureId>& current_;
    const PlanContext& context_;
    int pass_;
    std::string type_;
    bool report_;
};

struct Decision {
    PlanContext context;
    std::optional<LeftOut> left_out;
};

bool rule_on(const PlanOptions& options, const std::string& rule) {
    return options.elide && options.rules_off.count(rule) == 0;
}

// First to last: which passes are left out. Last to first: which planes each pass must produce.
Result<std::vector<Decision>> decide(const Chain& chain, const FrameDescription& frame,
                                     const PlanOptions& options) {
    std::vector<Decision> decisions;
    // What identity() sees as wanted: an upper bound, every plane a later pass could read.
    std::vector<RoleSet> readable(chain.links.size(), options.outputs);
    for (size_t i = chain.links.size(); i-- > 1;) {
        const RoleUse use = chain.links[i].pass->roles();
        readable[i - 1] = readable[i] | use.required | use.optional;
    }
    RoleSet available = frame.planes;
    for (size_t i = 0; i < chain.links.size(); ++i) {
        const auto& [type, pass] = chain.links[i];
        const std::string place = concat("passes[", i, "].", type->name);
        const RoleUse use = pass->roles();
        const RoleSet missing = use.required - available;
        if (!missing.empty())
            return Status(StatusCode::input, place + ": needs " + missing.text() +
                                                 "; the frame has " + available.text());
        if (Status status = pass->check(frame); !status.ok()) return status.at(place);
        Decision decision{{frame, options.precision, available, readable[i]}, std::nullopt};
        if (auto left = pass->identity(decision.context); left && rule_on(options, left->rule)) {
            left->what = type->name;
            decision.left_out = left;
        } else {
            available = available | use.on_demand;
        }
        decisions.push_back(std::move(decision));
    }
    RoleSet wanted = options.outputs;
    for (size_t i = chain.links.size(); i-- > 0;) {
        Decision& decision = decisions[i];
        decision.context.wanted = wanted;
        if (decision.left_out) continue;
        const RoleUse use = chain.links[i].pass->roles();
        wanted = ((wanted - use.on_demand) | use.required | use.optional) | (wanted & use.carried);
    }
    // What exists follows what is wanted: a plane on demand exists only if it was made.
    RoleSet existing = frame.planes;
    for (size_t i = 0; i < chain.links.size(); ++i) {
        Decision& decision = decisions[i];
        decision.context.available = existing;
        if (!decision.left_out)
            existing =
                existing | (chain.links[i].pass->roles().on_demand & decision.context.wanted);
    }
    return decisions;
}

// Lifetimes; planes that are imported but touched by no step are left out.
void find_lifetimes(Plan& plan) {
    for (int i = 0; i < int(plan.steps.size()); ++i) {
        for (const auto& binding : plan.steps[size_t(i)].bindings) {
            auto& texture = plan.textures[size_t(binding.texture)];
            if (texture.first_step < 0) texture.first_step = i;
            texture.last_step = i;
            if (texture.imported) plan.reads.add(texture.role);
        }
    }
    for (const auto& [role, id] : plan.outputs) {
        auto& texture = plan.textures[size_t(id)];
        if (texture.first_step >= 0) texture.last_step = int(plan.steps.size()) - 1;
    }
}

}  // namespace

Result<Plan> make_plan(const Chain& chain, const FrameDescription& given,
                       const PlanOptions& options) {
    FrameDescription frame = given;
    frame.camera = frame.camera.overlaid_by(chain.camera);
    auto decisions = decide(chain, frame, options);
    if (!decisions.ok()) return decisions.status();

    Plan plan;
    plan.frame_number = frame.frame_number;
    plan.width = frame.width;
    plan.height = frame.height;
    plan.precision = options.precision;
    plan.chain_hash = chain.hash();
    std::map<Role, TextureId> current;
    for (Role role : kAllRoles) {
        if (!frame.planes.has(role)) continue;
        PlanTexture texture;
        texture.name = std::string("input.") + name_of(role);
        // Inputs keep full precision: a pass left out must change no bit.
        texture.format = plane_format(channels_of(role), Precision::fp32);
        texture.width = frame.width;
        texture.height = frame.height;
        texture.imported = true;
        texture.role = role;
        current[role] = TextureId(plan.textures.size());
        plan.textures.push_back(texture);
    }

    for (size_t i = 0; i < chain.links.size(); ++i) {
        const auto& [type, pass] = chain.links[i];
        const Decision& decision = (*decisions)[i];
        plan.passes.push_back(
            {type->name, type->parameters->text(pass->parameters()), bool(decision.left_out)});
        if (!decision.left_out) {
            Recorder recorder(plan, current, decision.context, int(i), type->name, true);
            pass->plan(recorder);
            continue;
        }
        // What it would have cost.
        Plan scratch;
        scratch.textures = plan.textures;
        std::map<Role, TextureId> scratch_current = current;
        Recorder recorder(scratch, scratch_current, decision.context, int(i), type->name, false);
        pass->plan(recorder);
        LeftOut left = *decision.left_out;
        left.dispatches = int(scratch.steps.size());
        left.bytes = scratch.transient_bytes() - plan.transient_bytes();
        for (const auto& step : scratch.steps) left.taps += step.taps;
        plan.left_out.push_back(std::move(left));
    }
    for (Role role : kAllRoles)
        if (options.outputs.has(role) && current.count(role)) plan.outputs[role] = current[role];
    find_lifetimes(plan);
    for (const auto& texture : plan.textures) {
        if (texture.imported && texture.first_step < 0 && !options.outputs.has(texture.role))
            plan.left_out.push_back(
                {texture.name, kRuleUnusedPlane, "no step reads it", texture.bytes(), 0, 0});
    }
    return plan;
}

Result<ReferenceFrame> run_reference(const Chain& chain, const FrameDescription& given,
                                     const FramePlanes& planes, const PlanOptions& options) {
    FrameDescription frame = given;
    frame.camera = frame.camera.overlaid_by(chain.camera);
    PlanOptions all = options;
    all.elide = false;
    auto decisions = decide(chain, frame, all);
    if (!decisions.ok()) return decisions.status();
    ReferenceFrame result;
    for (const auto& [role, plane] : planes) result.planes[role] = image_cast<double>(plane);
    for (size_t i = 0; i < chain.links.size(); ++i) {
        ReferenceFrame one;
        one.planes = std::move(result.planes);
        chain.links[i].pass->reference((*decisions)[i].context, one);
        result.planes = std::move(one.planes);
        for (auto& [name, stage] : one.stages)
            result.stages[concat(i, ".", chain.links[i].type->name, ".", name)] = std::move(stage);
    }
    return result;
}

}  // namespace postchain
