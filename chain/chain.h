// A chain: passes in the order they run, with their parameters, and the camera it brings.
#pragma once

#include <memory>
#include <vector>

#include "chain/frame.h"
#include "chain/pass.h"

namespace postchain {

struct ChainLink {
    const PassType* type = nullptr;  // owned by the registry
    std::unique_ptr<Pass> pass;
    std::string text() const;  // "motion_blur: samples=25 ..."
};

struct Chain {
    std::vector<ChainLink> links;
    Camera camera;  // what the chain file says; unset members come from the frame

    // A copy with passes of its own.
    Chain clone() const;
    // Appends a pass with default parameters; nullptr when the registry has no such type.
    Pass* append(const PassRegistry& registry, std::string_view type);
    // Planes any pass requires or can use.
    RoleSet required() const;
    RoleSet optional() const;
    std::string text() const;  // canonical
    uint64_t hash() const;     // of text()
};

}  // namespace postchain
