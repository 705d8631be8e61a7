#include "chain/pass/resolved_chain.h"

#include <algorithm>

#include "chain/pass/planner.h"
#include "shaders/shared/frame_uniforms.h"

namespace postchain {
namespace {

// If earlier passes have moved color farther than this (px), neighboring frames are not used: their
// color has not been through those passes. Only the passes' reach decides, so that rules do not
// change it.
constexpr double kSpreadWithNeighborsPx = 2;

// Why the rules elide a pass; an error if it must run and cannot.
Result<std::optional<Identity>> judge_pass(const Pass& pass, const PassOnFrame& on_frame,
                                           const PlanContext& context) {
    std::optional<Identity> identity = on_frame.identity(context);
    if (identity && !context.uses(identity->rule)) identity.reset();
    const RoleSet missing = pass.roles().required - context.available;
    // A pass that is off needs no plane; but nothing is known of a plane that does not exist.
    if (missing.empty() || (identity && identity->rule != kRuleFacts)) return identity;
    if (!context.uses(kRuleMissingPlane))
        return Status(StatusCode::input, missing_text(pass, context.available, context.frame));
    return std::optional(Identity{kRuleMissingPlane, {"a plane is missing"}});
}

std::string place_of(const Chain& chain, size_t link) {
    return concat("passes[", link, "].", chain.links[link].type->name);
}

}  // namespace

RoleSet without_neighbors(RoleSet planes) {
    for (const Neighbor neighbor : kNeighbors)
        for (const Role role : kNeighborRoles) planes.remove(role_of(neighbor, role));
    planes.remove(Role::behind);
    return planes;
}

std::string missing_text(const Pass& pass, RoleSet available, const FrameDescription& frame) {
    const RoleSet has = available | frame.not_converted;
    return "needs " + (pass.roles().required - has).text() + "; the frame has " + has.text();
}

FrameDescription seen_by(const Chain& chain, const FrameDescription& given) {
    FrameDescription frame = given;
    frame.camera = frame.camera.overlaid_by(chain.camera);
    return frame;
}

RoleSet outputs_of(const FrameDescription& frame, const PlanOptions& options) {
    return options.outputs | (frame.planes & RoleSet{Role::layers});
}

RoleSet readable_after(const Chain& chain, size_t pass) {
    RoleSet readable;
    for (size_t i = pass + 1; i < chain.links.size(); ++i) {
        const RoleUse use = chain.links[i].pass->roles();
        readable = readable | use.required | use.optional;
    }
    return readable;
}

PlanContext ResolvedChain::context(size_t pass) const {
    const PlanShape::OfPass& decided = shape_.passes[pass];
    return {frame_,  options_->precision, decided.available, decided.wanted, decided.color_is_input,
            *rules_, options_->device};
}

Status ResolvedChain::resolve(const Chain& chain, const FrameDescription& frame,
                              const PlanOptions& options, const RuleNames& rules) {
    if (frame.planes.has(Role::layers) != (frame.layers > 0))
        return Status(StatusCode::internal,
                      "the frame's number of layers is not that of its plane");
    chain_ = &chain;
    options_ = &options;
    rules_ = &rules;
    links_.clear();
    frame_ = seen_by(chain, frame);
    if (!rules.contains(kRuleCameraCut)) frame_.bounds.camera_cut = false;
    shape_.passes.assign(chain.links.size(), {});
    RETURN_IF_ERROR(judge());
    find_wanted();
    return Status();
}

// First to last: resolves the passes and decides which are elided. Their identity() sees as wanted
// an upper bound: every plane that a later pass could read.
Status ResolvedChain::judge() {
    auto& passes = shape_.passes;
    RoleSet available = frame_.planes;
    bool color_is_input = true;
    double spread_px = 0;
    first_spreading_ = passes.size();
    for (size_t i = 0; i < passes.size(); ++i) {
        const Pass& pass = *chain_->links[i].pass;
        if (i > first_spreading_) available = without_neighbors(available);
        passes[i].available = available;
        passes[i].wanted = outputs_of(frame_, *options_) | readable_after(*chain_, i);
        passes[i].color_is_input = color_is_input;
        auto resolved = resolve_link(*chain_, i, frame_);
        if (!resolved.ok()) return resolved.status().at(place_of(*chain_, i));
        const ResolvedPass& on_frame = *resolved;
        auto identity = judge_pass(pass, *on_frame, context(i));
        if (!identity.ok()) return identity.status().at(place_of(*chain_, i));
        spread_px += on_frame->reach().spreads_px;
        if (spread_px > kSpreadWithNeighborsPx) first_spreading_ = std::min(first_spreading_, i);
        // An elided pass makes nothing: an earlier plane of that role must not stand in for it.
        const RoleSet made = pass.roles().on_demand;
        passes[i].elided = identity->has_value();
        links_.push_back({std::move(*resolved), *identity});
        available = passes[i].elided ? available - made : available | made;
        if (!passes[i].elided) color_is_input = false;
    }
    return Status();
}

// Last to first: which planes a later pass that runs reads. The passes that run make their planes
// on demand if these are wanted; no pass that runs reads others.
void ResolvedChain::find_wanted() {
    auto& passes = shape_.passes;
    RoleSet wanted = outputs_of(frame_, *options_);
    for (size_t i = passes.size(); i-- > 0;) {
        passes[i].wanted = rules_->contains(kRuleUnusedStep) ? wanted : kEveryRole;
        const RoleUse use = chain_->links[i].pass->roles();
        const RoleSet carried = wanted & use.carried;
        wanted = wanted - use.on_demand;
        if (passes[i].elided) continue;
        wanted = wanted | use.required | use.optional | carried;
        passes[i].numbers = links_[i].pass->shape(context(i));
    }
}

void write_uniforms(const PassOnFrame& pass, const PlanContext& context, UniformWriter& uniforms) {
    shared::FrameUniforms size{};
    size.size = {context.frame.width, context.frame.height};
    uniforms.set(size);
    pass.write_uniforms(context, uniforms);
}

void write_values(const ResolvedChain& resolved, Plan& plan) {
    plan.frame_number = resolved.frame().frame_number;
    for (size_t i = 0; i < resolved.links().size(); ++i) {
        plan.passes[i].tiles = resolved.links()[i].pass->tile_edge();
        if (resolved.shape().passes[i].elided) continue;
        UniformWriter uniforms(plan, int(i));
        write_uniforms(*resolved.links()[i].pass, resolved.context(i), uniforms);
    }
    if (plan.width != resolved.frame().width || plan.height != resolved.frame().height)
        fit(plan, resolved.frame().width, resolved.frame().height);
}

}  // namespace postchain
