// The frames that a ready plan is for, and the plan of a frame among those that an executor keeps.
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "chain/guest/failure.h"
#include "chain/guest/host_frame.h"
#include "chain/guest/host_plan.h"
#include "chain/resolved_chain.h"

namespace postchain::guest {

// Frames of the same key and shape share a plan.
struct Purpose {
    PlanKey key;
    PlanOptions options;
    RuleNames rules;  // options.rules() of the chain
    PlanShape shape;
    FrameValues values = {};  // of the frame whose bytes are in its uniform blocks
    uint64_t frame_number = 0;
};

// Resolves the chain on the frame. `purpose`, to which `resolved` refers then, becomes the frame's.
Status resolve(const Chain& chain, const HostFrame& frame, const PlanKey& key,
               ResolvedChain& resolved, Purpose& purpose);

// The entry of this key and shape, with the frame's values; null if there is none. An entry has a
// Purpose, `purpose`, and the executor's plan, `compiled`.
template <class Entry>
Failure find_entry(const std::vector<std::unique_ptr<Entry>>& entries, const Chain& chain,
                   const HostFrame& frame, const PlanKey& key, ResolvedChain& resolved,
                   Entry*& entry) {
    entry = nullptr;
    const FrameValues values = values_of(frame);
    const uint64_t number = frame.given->frame_number;
    for (const auto& known : entries) {
        const Purpose& purpose = known->purpose;
        if (purpose.key != key || purpose.values != values) continue;
        if (known->compiled.plan().uses_frame_number && purpose.frame_number != number) continue;
        entry = known.get();
        return {};
    }
    bool is_resolved = false;
    for (const auto& known : entries) {
        Purpose& purpose = known->purpose;
        if (purpose.key != key) continue;
        if (!is_resolved)
            RETURN_IF_ERROR(
                resolved.resolve(chain, describe(frame, chain), purpose.options, purpose.rules));
        is_resolved = true;
        if (purpose.shape != resolved.shape()) continue;
        known->compiled.rewrite_values([&](Plan& plan) { write_values(resolved, plan); });
        purpose.values = values;
        purpose.frame_number = number;
        entry = known.get();
        return {};
    }
    return {};
}

// The uniform block of the steps that convert this frame from and to the host's textures.
shared::GuestUniforms uniforms_of(const HostFrame& frame, const HostPlan& host, const Plan& plan);

// Hands the frame's textures and values to the executor's plan.
template <class Compiled>
void import_frame(const HostPlan& host, const HostFrame& frame, Compiled& compiled) {
    if (host.color >= 0) compiled.import(host.color, frame.color.name);
    if (host.depth >= 0) compiled.import(host.depth, frame.depth.name);
    if (host.motion >= 0) compiled.import(host.motion, frame.motion.name);
    if (host.mask >= 0) compiled.import(host.mask, frame.mask.name);
    if (host.exposure >= 0) compiled.import(host.exposure, frame.exposure.name);
    if (host.writes_output)
        compiled.import(host.result, frame.output.name, frame.output.format->name,
                        frame.output.image);
    if (host.own_steps.empty()) return;
    const shared::GuestUniforms uniforms = uniforms_of(frame, host, compiled.plan());
    for (const int step : host.own_steps)
        compiled.set_uniforms(step, std::as_bytes(std::span(&uniforms, 1)));
}

}  // namespace postchain::guest
