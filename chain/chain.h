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

// What a pass leaves of an object that its matte covers (docs/layers.md): all of it as it is, or
// its place while the shutter is open.
enum class MatteEffect { unblurred, unmoved };

struct ChainLink {
    const PassType* type = nullptr;  // owned by the registry
    std::unique_ptr<Pass> pass;
    // Name of what covers objects that this pass treats apart (docs/layers.md); empty: none. Who
    // makes the frame's description finds it and says which of the frame's mattes it is.
    std::string matte = {};
    std::optional<MatteEffect> matte_effect = {};  // unset: unblurred

    bool keeps_still() const { return matte_effect == MatteEffect::unmoved; }
    // Errors (chain): an effect without a matte; unmoved where the pass reads no motion.
    Status check_matte() const;
    std::string values_text() const;  // "samples=25 ... matte=hero"
    std::string text() const;         // "motion_blur: samples=25 ..."

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
