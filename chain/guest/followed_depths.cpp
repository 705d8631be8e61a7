#include "chain/guest/followed_depths.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace postchain::guest {
namespace {

// Each place goes on from the depth of the nearest place before, so that focus is pulled from
// there.
void move_from(const Depths& before, Depths& places) {
    for (auto& [place, depth] : places) {
        double nearest = std::numeric_limits<double>::infinity();
        for (const auto& [old, old_depth] : before) {
            const double distance = std::hypot(old[0] - place[0], old[1] - place[1]);
            if (distance >= nearest) continue;
            nearest = distance;
            depth = old_depth;
        }
    }
}

}  // namespace

ProgramKey focus_program(const HostFrame& frame) {
    return {"guest/focus.comp", {{"ARRAYS", std::to_string(frame.arrays() & GUEST_ARRAY_DEPTH)}}};
}

Step focus_step(const HostFrame& frame, TextureId depth, TextureId found) {
    Step step;
    step.name = "depths";
    step.program = focus_program(frame);
    step.bindings = {{1, depth}, {0, found, Access::list}};
    step.spread = Area::fixed(1, 1);
    step.set_uniforms(shared::GuestUniforms{});
    return step;
}

Failure find_places(const Chain& chain, Depths& places) {
    for (const ChainLink& link : chain.links)
        for (const Place& place : link.pass->depth_places()) places.emplace(place, 0);
    if (places.size() > GUEST_FOCUS_PLACES)
        return {PC_ERROR_CHAIN,
                concat("focus_at: the chain has ", places.size(), " places; at most ",
                       GUEST_FOCUS_PLACES, " can be followed")};
    return {};
}

void Followed::approach(const FoundDepths& found, const pc_frame& given) {
    const auto seconds = double(given.focus_seconds);
    const double part =
        !known || seconds == 0 ? 1 : -std::expm1(-double(given.frame_seconds) / seconds);
    size_t i = 0;
    for (auto& entry : depths) entry.second += part * (double(found[i++]) - entry.second);
    known = true;
}

Followed& FollowedChains::find(uint64_t chain, const Depths& places, uint64_t next) {
    auto found = std::find_if(chains_.begin(), chains_.end(),
                              [&](const Followed& one) { return one.chain == chain; });
    if (found == chains_.end()) {
        if (chains_.size() < kMost) {
            chains_.push_back({chain, chains_.size(), places, false, next});
            return chains_.back();
        }
        found = chains_.begin();
        *found = {chain, found->number, {}, false, next};
    }
    std::rotate(found, found + 1, chains_.end());
    Followed& followed = chains_.back();
    const auto same = [](const auto& a, const auto& b) { return a.first == b.first; };
    if (std::equal(followed.depths.begin(), followed.depths.end(), places.begin(), places.end(),
                   same))
        return followed;
    Depths moved = places;
    move_from(followed.depths, moved);
    followed.depths = std::move(moved);
    followed.since = next;
    return followed;
}

}  // namespace postchain::guest
