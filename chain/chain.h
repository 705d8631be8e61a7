// A chain: passes in the order they run, with their parameters, and the camera it brings.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "chain/frame.h"
#include "chain/origin.h"
#include "chain/pass.h"

namespace postchain {

struct ChainLink {
    const PassType* type = nullptr;  // owned by the registry
    std::unique_ptr<Pass> pass;
    // Name of what holds out objects from this pass (docs/layers.md); empty: none. Who makes the
    // frame's description finds it and says which of the frame's mattes it is.
    std::string matte = {};
    std::string text() const;  // "motion_blur: samples=25 ..."

    ChainLink clone() const;  // with a pass of its own
    // This link as it is set if it keeps the promise, else by the first of its variants that does;
    // nothing when it has none.
    std::optional<ChainLink> that_promises(const std::function<bool(const Promises&)>& kept) const;
};

struct Chain {
    std::vector<ChainLink> links;
    Camera camera;    // what the chain file says; unset members come from the frame
    Origins origins;  // of its values that are stated, for the record; no part of its text

    // A copy with passes of its own.
    Chain clone() const;
    // Appends a pass with default parameters; nullptr when the registry has no such type.
    Pass* append(const PassRegistry& registry, std::string_view type);
    std::vector<std::string> types() const;  // of the passes, in order
    // Planes any pass requires or can use.
    RoleSet required() const;
    RoleSet optional() const;
    // Of all passes together; of a chain without passes, everything.
    Promises promises() const;
    Reach reach(const FrameDescription& frame) const;
    // Every link that_promises(); nothing when one cannot.
    std::optional<Chain> that_promises(const std::function<bool(const Promises&)>& kept) const;
    std::string text() const;  // canonical
    uint64_t hash() const;     // of text()
};

}  // namespace postchain
