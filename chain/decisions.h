// What the planner decides before it plans: which passes of a chain are elided on a frame, which
// planes exist where each stands, and which it has to make.
#pragma once

#include <optional>
#include <string_view>
#include <vector>

#include "chain/planner.h"

namespace postchain {

// Why a pass is elided.
struct Reason {
    std::string_view rule;
    Fact fact;
};

// First to last: which passes are elided. Last to first: which planes each pass must produce.
// `frame`: of seen_by(). `reasons`: one for each pass; null: they are not asked for. Errors: of
// make_plan().
Status decide(const Chain& chain, const FrameDescription& frame, const PlanOptions& options,
              const RuleNames& rules, PlanShape& shape, std::vector<Reason>* reasons);

// What a pass may know when it plans.
PlanContext context_of(const FrameDescription& frame, const PlanOptions& options,
                       const RuleNames& rules, const PlanShape::OfPass& pass);

// The pass that moves color too far for the planes of other frames to be of use after it; the
// number of passes if there is none.
size_t first_spreading_pass(const Chain& chain, const FrameDescription& frame);

// The frame as a pass with a matte sees it; nothing where it has none.
std::optional<FrameDescription> seen_with_matte(const Chain& chain, const FrameDescription& frame,
                                                size_t pass);

// Planes that a plan of this frame gives: those that are asked for, and its further layers.
RoleSet outputs_of(const PlanOptions& options, const FrameDescription& frame);

// The frame with the chain's own camera laid over its.
FrameDescription seen_by(const Chain& chain, const FrameDescription& given);

}  // namespace postchain
