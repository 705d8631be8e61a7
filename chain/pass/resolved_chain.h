// A chain on one frame: every pass resolved, and the decisions that come before planning, namely
// which passes are elided, which planes exist where each pass runs, and which it has to make.
#pragma once

#include <optional>
#include <vector>

#include "chain/pass/chain.h"
#include "chain/pass/matte.h"

namespace postchain {

struct PlanOptions;

// The decisions about a frame from which programs, textures, bindings and groups of its plan
// follow, so far as they depend on its size, camera, bounds and number. Frames that differ only in
// these four and have equal PlanShapes have plans of one shape: such plans differ in what fit()
// sets, in bytes of uniform blocks, in counts of taps and in the numbers of elisions.
struct PlanShape {
    struct OfPass {
        RoleSet available, wanted;  // PlanContext
        bool color_is_input = false;
        bool elided = false;
        ShapeNumbers numbers = {};
        bool operator==(const OfPass&) const = default;
    };
    std::vector<OfPass> passes;
    bool operator==(const PlanShape&) const = default;
};

// Cannot be moved, because the resolved passes refer to its frame.
class ResolvedChain {
  public:
    struct Link {
        ResolvedPass pass;
        std::optional<Identity> identity;  // why it is elided; empty: it runs
    };

    ResolvedChain() = default;
    ResolvedChain(const ResolvedChain&) = delete;
    ResolvedChain& operator=(const ResolvedChain&) = delete;

    // Replaces an earlier frame. Allocates only if it fails or a pass has a matte. Copies the frame
    // and refers to the other arguments. `rules`: options.rules(chain). Errors: those of
    // make_plan().
    Status resolve(const Chain& chain, const FrameDescription& frame, const PlanOptions& options,
                   const RuleNames& rules);

    const Chain& chain() const { return *chain_; }
    const FrameDescription& frame() const { return frame_; }  // with the chain's camera
    const PlanOptions& options() const { return *options_; }
    const RuleNames& rules() const { return *rules_; }
    const std::vector<Link>& links() const { return links_; }
    const PlanShape& shape() const { return shape_; }
    // The pass that moves color too far for the planes of other frames to be of use after it; the
    // number of passes if there is none.
    size_t first_spreading_pass() const { return first_spreading_; }
    PlanContext context(size_t pass) const;

  private:
    Status judge();
    void find_wanted();

    const Chain* chain_ = nullptr;
    const PlanOptions* options_ = nullptr;
    const RuleNames* rules_ = nullptr;
    FrameDescription frame_;
    std::vector<Link> links_;
    PlanShape shape_;
    size_t first_spreading_ = 0;
};

// Planes that exist for passes after one that moves color too far: without those of other frames.
RoleSet without_neighbors(RoleSet planes);

// The planes that a pass requires and the frame does not have, and the ones found instead.
std::string missing_text(const Pass& pass, RoleSet available, const FrameDescription& frame);

// The frame with the chain's own camera laid over its.
FrameDescription seen_by(const Chain& chain, const FrameDescription& given);
// Planes that a plan of the frame returns: the requested ones, and its extra layers.
RoleSet outputs_of(const FrameDescription& frame, const PlanOptions& options);
// The planes that the passes after this one could read.
RoleSet readable_after(const Chain& chain, size_t pass);

// Makes `plan`, of a frame of the same shape, one of this frame: its size, and the bytes of its
// uniform blocks. Blocks of steps that were added to it since are left alone. Allocates nothing.
void write_values(const ResolvedChain& resolved, Plan& plan);
// The blocks of one pass: its own, and those that hold the frame's size.
void write_uniforms(const PassOnFrame& pass, const PlanContext& context, UniformWriter& uniforms);

}  // namespace postchain
