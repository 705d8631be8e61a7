// A chain: passes in the order they run, with their parameters, and the camera it brings.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "chain/frame/frame.h"
#include "chain/frame/origin.h"
#include "chain/pass/pass.h"

namespace postchain {

// How a pass treats an object that its matte covers (docs/layers.md): leaves it unblurred, or holds
// it in its place while the shutter is open.
enum class MatteEffect { unblurred, unmoved };

struct ChainLink {
    const PassType* type = nullptr;  // owned by the registry
    std::unique_ptr<Pass> pass;
    // Name of the matte over objects that this pass treats differently (docs/layers.md); empty:
    // none. The code that describes the frame finds it among the frame's mattes.
    std::string matte = {};
    std::optional<MatteEffect> matte_effect = {};  // unset: unblurred

    bool keeps_still() const { return matte_effect == MatteEffect::unmoved; }
    // Errors (chain): an effect without a matte; unmoved if the pass reads no motion.
    Status check_matte() const;
    std::string values_text() const;  // "samples=25 ... matte=hero"
    std::string text() const;         // "motion_blur: samples=25 ..."

    ChainLink clone() const;  // with a pass of its own
    // This link as it is set if it keeps the guarantee, otherwise with the settings of the first
    // variant that does; empty if none does.
    std::optional<ChainLink> that_guarantees(
        const std::function<bool(const Guarantees&)>& kept) const;
};

// A chain's passes are at most this many, so that a request cannot make planning take long.
inline constexpr size_t kMaxPasses = 64;

struct Chain {
    std::vector<ChainLink> links;
    Camera camera;    // from the chain file; unset members come from the frame
    Origins origins;  // origins of its stated values, for the record; not part of its text

    // A copy with passes of its own.
    Chain clone() const;
    // Appends a pass with default parameters; nullptr when the registry has no such type.
    Pass* append(const PassRegistry& registry, std::string_view type);
    std::vector<std::string> types() const;  // types of the passes, in order
    // Planes any pass requires or can use.
    RoleSet required() const;
    RoleSet optional() const;
    // The guarantees of all passes together; a chain without passes guarantees everything.
    Guarantees guarantees() const;
    Reach reach(const FrameDescription& frame) const;
    // Every link that_guarantees(); empty if one cannot.
    std::optional<Chain> that_guarantees(const std::function<bool(const Guarantees&)>& kept) const;
    std::string text() const;  // canonical
    uint64_t hash() const;     // hash of text()
};

}  // namespace postchain
