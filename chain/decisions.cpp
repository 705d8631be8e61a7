#include "chain/decisions.h"

#include "chain/hold_still.h"
#include "chain/matte.h"

namespace postchain {
namespace {

// Planes that the pass requires and the frame does not have: what was found instead.
std::string missing_text(const Pass& pass, const PlanContext& context) {
    const RoleSet has = context.available | context.frame.not_converted;
    return "needs " + (pass.roles().required - has).text() + "; the frame has " + has.text();
}

// What the rules say of one pass; an error when it must run and cannot.
Result<std::optional<Identity>> judge(const ChainLink& link, const PlanContext& context) {
    using Verdict = std::optional<Identity>;
    if (Status status = link.pass->check(context.frame); !status.ok()) return status;
    Verdict identity = link.pass->identity(context);
    if (identity && !context.uses(identity->rule)) identity.reset();
    const RoleSet missing = link.pass->roles().required - context.available;
    // A pass that is off needs no plane; but of a plane that is not there nothing is known.
    if (missing.empty() || (identity && identity->rule != kRuleFacts)) return identity;
    if (!context.uses(kRuleMissingPlane))
        return Status(StatusCode::input, missing_text(*link.pass, context));
    return Verdict(Identity{kRuleMissingPlane, {"a plane is missing"}});
}

// A pass before this one that moves color farther than this (px) makes the planes of other frames
// strangers to the color: they have not been through it. By the passes' bounds alone, so that rules
// change nothing of it.
constexpr double kSpreadWithNeighborsPx = 2;

RoleSet without_neighbors(RoleSet planes) {
    for (const Neighbor neighbor : kNeighbors)
        for (const Role role : kNeighborRoles) planes.remove(role_of(neighbor, role));
    return planes;
}

// With a matte a neighbor serves only where its mattes are there too. Where the matte is held out
// of the pass, the held layers are filtered.
RoleSet with_matte(RoleSet planes, RoleSet of_frame, bool held) {
    if (held) planes.add(Role::layers);
    for (const Neighbor neighbor : kNeighbors) {
        if (planes.has(role_of(neighbor, Role::mattes)) &&
            (!of_frame.has(Role::layers) || planes.has(role_of(neighbor, Role::layers)))) {
            if (held) planes.add(role_of(neighbor, Role::layers));
            continue;
        }
        for (const Role role : kNeighborRoles) planes.remove(role_of(neighbor, role));
    }
    return planes;
}

}  // namespace

PlanContext context_of(const FrameDescription& frame, const PlanOptions& options,
                       const RuleNames& rules, const PlanShape::OfPass& pass) {
    return {frame, options.precision, pass.available, pass.wanted, pass.color_is_input, rules};
}

size_t first_spreading_pass(const Chain& chain, const FrameDescription& frame) {
    double spread_px = 0;
    for (size_t i = 0; i < chain.links.size(); ++i) {
        spread_px += chain.links[i].pass->reach(frame).spreads_px;
        if (spread_px > kSpreadWithNeighborsPx) return i;
    }
    return chain.links.size();
}

RoleSet outputs_of(const PlanOptions& options, const FrameDescription& frame) {
    return options.outputs | (frame.planes & RoleSet{Role::layers});
}

std::optional<FrameDescription> seen_with_matte(const Chain& chain, const FrameDescription& frame,
                                                size_t pass) {
    const int matte = matte_of(frame, pass);
    if (matte < 0) return std::nullopt;
    return chain.links[pass].keeps_still() ? with_still_objects(frame, matte)
                                           : with_held_layers(frame);
}

FrameDescription seen_by(const Chain& chain, const FrameDescription& given) {
    FrameDescription frame = given;
    frame.camera = frame.camera.overlaid_by(chain.camera);
    return frame;
}

Status decide(const Chain& chain, const FrameDescription& frame, const PlanOptions& options,
              const RuleNames& rules, PlanShape& shape, std::vector<Reason>* reasons) {
    if (frame.planes.has(Role::layers) != (frame.layers > 0))
        return Status(StatusCode::internal,
                      "the frame's number of layers is not that of its plane");
    const size_t spreading = first_spreading_pass(chain, frame);
    auto& passes = shape.passes;
    passes.assign(chain.links.size(), {});
    if (reasons) reasons->assign(passes.size(), {});
    // What identity() sees as wanted: an upper bound, every plane a later pass could read.
    RoleSet readable = outputs_of(options, frame);
    for (size_t i = passes.size(); i-- > 0;) {
        passes[i].wanted = readable;
        const RoleUse use = chain.links[i].pass->roles();
        readable = readable | use.required | use.optional;
    }
    RoleSet available = frame.planes;
    bool color_is_input = true;
    for (size_t i = 0; i < passes.size(); ++i) {
        const Pass& pass = *chain.links[i].pass;
        if (i > spreading) available = without_neighbors(available);
        passes[i].available = available;
        passes[i].color_is_input = color_is_input;
        const auto seen = seen_with_matte(chain, frame, i);
        Status of_matte = chain.links[i].check_matte();
        if (const std::string& name = chain.links[i].matte; of_matte.ok() && !name.empty() && !seen)
            of_matte = Status(
                StatusCode::input,
                concat("matte ", name, " was not handed in with frame ", frame.frame_number));
        if (!of_matte.ok())
            return of_matte.at(concat("passes[", i, "].", chain.links[i].type->name));
        const PlanContext context = context_of(seen ? *seen : frame, options, rules, passes[i]);
        auto identity = judge(chain.links[i], context);
        if (!identity.ok())
            return identity.status().at(concat("passes[", i, "].", chain.links[i].type->name));
        // What an elided pass would have made is nothing: an earlier plane of that role
        // must not stand in for it.
        const RoleSet made = pass.roles().on_demand;
        available = *identity ? available - made : available | made;
        passes[i].elided = identity->has_value();
        if (!*identity) color_is_input = false;
        if (!*identity || !reasons) continue;
        const auto& [rule, fact] = **identity;
        (*reasons)[i] = {
            rule, rule == kRuleMissingPlane ? Fact{missing_text(pass, context)} : fact.fact()};
    }
    RoleSet wanted = outputs_of(options, frame);
    RoleSet all;
    for (Role role : kAllRoles) all.add(role);
    for (size_t i = passes.size(); i-- > 0;) {
        passes[i].wanted = rules.contains(kRuleUnusedStep) ? wanted : all;
        const RoleUse use = chain.links[i].pass->roles();
        if (passes[i].elided) {
            wanted = wanted - use.on_demand;
            continue;
        }
        wanted = ((wanted - use.on_demand) | use.required | use.optional) | (wanted & use.carried);
    }
    // What exists follows what is wanted: a plane on demand exists only if it was made.
    RoleSet existing = frame.planes;
    for (size_t i = 0; i < passes.size(); ++i) {
        PlanShape::OfPass& pass = passes[i];
        if (i > spreading) existing = without_neighbors(existing);
        pass.available = existing;
        if (!pass.elided && matte_of(frame, i) >= 0)
            pass.available = with_matte(existing, frame.planes, !chain.links[i].keeps_still());
        const RoleSet made = chain.links[i].pass->roles().on_demand;
        existing = pass.elided ? existing - made : existing | (made & pass.wanted);
        if (!pass.elided)
            pass.numbers = chain.links[i].pass->shape(context_of(frame, options, rules, pass));
    }
    return Status();
}

}  // namespace postchain
