#include "chain/pass/chain.h"

namespace postchain {

Status ChainLink::check_matte() const {
    if (!matte_effect) return Status();
    if (matte.empty())
        return Status(StatusCode::chain,
                      "matte_effect says what is done with a matte, and none is named; name one "
                      "with matte, or leave matte_effect out");
    if (keeps_still() && !pass->roles().required.has(Role::motion))
        return Status(StatusCode::chain, "matte_effect is unmoved, and " + type->name +
                                             " moves nothing; use unblurred, or leave it out");
    return Status();
}

std::string ChainLink::values_text() const {
    return type->parameters->text(pass->parameters()) + (matte.empty() ? "" : " matte=" + matte) +
           (keeps_still() ? " matte_effect=unmoved" : "");
}

std::string ChainLink::text() const {
    return type->name + ": " + values_text();
}

ChainLink ChainLink::clone() const {
    ChainLink twin{type, type->create(), matte, matte_effect};
    for (const auto& row : type->parameters->rows())
        row.set(twin.pass->parameters(), row.get(pass->parameters()));
    return twin;
}

std::optional<ChainLink> ChainLink::that_guarantees(
    const std::function<bool(const Guarantees&)>& kept) const {
    if (kept(pass->guarantees())) return clone();
    for (const PassVariant& variant : type->variants) {
        ChainLink other = clone();
        bool fits = true;
        for (const auto& [key, value] : variant.settings)
            fits = fits && type->parameters->set(other.pass->parameters(), key, value).ok();
        if (fits && kept(other.pass->guarantees())) return other;
    }
    return std::nullopt;
}

Chain Chain::clone() const {
    Chain copy;
    copy.camera = camera;
    copy.origins = origins;
    for (const auto& link : links) copy.links.push_back(link.clone());
    return copy;
}

Pass* Chain::append(const PassRegistry& registry, std::string_view type) {
    const PassType* found = registry.find(type);
    if (!found) return nullptr;
    links.push_back({found, found->create()});
    return links.back().pass.get();
}

std::vector<std::string> Chain::types() const {
    std::vector<std::string> types;
    for (const auto& link : links) types.push_back(link.type->name);
    return types;
}

RoleSet Chain::required() const {
    RoleSet roles = {Role::color};
    for (const auto& link : links) roles = roles | link.pass->roles().required;
    return roles;
}

RoleSet Chain::optional() const {
    RoleSet roles;
    for (const auto& link : links) roles = roles | link.pass->roles().optional;
    return roles - required();
}

Guarantees Chain::guarantees() const {
    Guarantees all;
    all.keeps_constants = true;
    all.convex = 0;
    all.lattice_px = 1;
    all.symmetries = {Symmetry::mirror, Symmetry::flip, Symmetry::turn, Symmetry::shift};
    all.light = Light::kept;
    for (size_t i = 0; i < links.size(); ++i) {
        const Guarantees own = links[i].pass->guarantees();
        if (i == 0) all.driven_by = own.driven_by;
        all = all.then(own);
    }
    return all;
}

Reach Chain::reach(const FrameDescription& given) const {
    FrameDescription frame = given;
    frame.camera = frame.camera.overlaid_by(camera);
    Reach all{0, 0};
    for (const auto& link : links) all = all.then(reach_of(*link.pass, frame));
    return all;
}

std::optional<Chain> Chain::that_guarantees(
    const std::function<bool(const Guarantees&)>& kept) const {
    Chain chain;
    chain.camera = camera;
    for (const auto& link : links) {
        auto one = link.that_guarantees(kept);
        if (!one) return std::nullopt;
        chain.links.push_back(std::move(*one));
    }
    return chain;
}

std::string Chain::text() const {
    std::string text = "camera: " + camera.text() + "\n";
    for (const auto& link : links) text += link.text() + "\n";
    return text;
}

uint64_t Chain::hash() const {
    return hash_text(text());
}

}  // namespace postchain
