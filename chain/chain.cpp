#include "chain/chain.h"

#include "chain/work_list.h"

namespace postchain {

const PassType* PassRegistry::find(std::string_view name) const {
    for (const auto& type : types_)
        if (type.name == name) return &type;
    return nullptr;
}

std::vector<ElisionRule> elision_rules(const PassRegistry& registry) {
    std::vector<ElisionRule> rules = chain_rules();
    for (const auto& type : registry.types())
        rules.insert(rules.end(), type.rules.begin(), type.rules.end());
    return rules;
}

LeftOut left_out_of_blocks(const std::string& what, const std::string& rule,
                           const std::string& reason, TextureId list, int taps_px, bool outside) {
    LeftOut left{what, rule, reason, 0, 0, 0};
    left.work_list = list;
    left.outside = outside;
    left.taps_per_block = uint64_t(kBlockPx) * kBlockPx * uint64_t(taps_px);
    return left;
}

std::string ChainLink::text() const {
    return type->name + ": " + type->parameters->text(pass->parameters());
}

Chain Chain::clone() const {
    Chain copy;
    copy.camera = camera;
    for (const auto& link : links) {
        ChainLink twin{link.type, link.type->create()};
        for (const auto& row : link.type->parameters->rows())
            row.set(twin.pass->parameters(), row.get(link.pass->parameters()));
        copy.links.push_back(std::move(twin));
    }
    return copy;
}

Pass* Chain::append(const PassRegistry& registry, std::string_view type) {
    const PassType* found = registry.find(type);
    if (!found) return nullptr;
    links.push_back({found, found->create()});
    return links.back().pass.get();
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

std::string Chain::text() const {
    std::string text = "camera: " + camera_parameters().text(&camera) + "\n";
    for (const auto& link : links) text += link.text() + "\n";
    return text;
}

uint64_t Chain::hash() const {
    return hash_text(text());
}

}  // namespace postchain
