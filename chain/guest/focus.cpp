#include "chain/guest/focus.h"

#include <epoxy/gl.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>
#include <utility>

#include "chain/gl/debug.h"

namespace postchain::guest {
namespace {

constexpr TextureId kDepth = 0, kFound = 1;

Plan one_step(const ProgramKey& program) {
    Plan plan;
    plan.passes.push_back({"focus", "", false, {}});
    PlanTexture depth, found;
    depth.name = "host.depth";
    depth.format = Format::r32f;
    found.name = "focus.depths";
    found.format = Format::work_list;
    depth.imported = found.imported = true;
    plan.textures = {depth, found};
    Step step;
    step.name = "depths";
    step.program = program;
    step.bindings = {{1, kDepth}, {0, kFound, Access::list}};
    step.set_uniforms(shared::GuestUniforms{});
    plan.steps.push_back(std::move(step));
    find_lifetimes(plan, {});
    return plan;
}

// The pixel of each place, and the radius around it.
void set_places(const Focus::Depths& places, const HostFrame& frame,
                shared::GuestUniforms& uniforms) {
    const auto pixel = [](double fraction, int size) {
        return int(std::clamp(std::floor(fraction * size), 0.0, size - 1.0));
    };
    const int radius = int(std::lround(double(frame.given->focus_radius) * frame.height));
    for (const auto& entry : places)
        uniforms.focus[uniforms.focus_count++] = {pixel(entry.first[0], frame.width),
                                                  pixel(entry.first[1], frame.height), radius, 0};
}

// Each place goes on from the depth of the nearest place before, so that focus is pulled from
// there.
void move_from(const Focus::Depths& before, Focus::Depths& places) {
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

Focus::~Focus() {
    if (buffer_) glDeleteBuffers(1, &buffer_);
}

void Focus::abandon() {
    for (Followed& followed : chains_)
        for (Slot& slot : followed.slots) slot.fence.abandon();
    buffer_ = 0;
    step_.reset();
}

ProgramKey Focus::program(const HostFrame& frame) {
    return {"guest/focus.comp", {{"ARRAYS", std::to_string(frame.arrays() & GUEST_ARRAY_DEPTH)}}};
}

Failure Focus::find_places(const Chain& chain, Depths& places) {
    for (const ChainLink& link : chain.links)
        for (const Place& place : link.pass->depth_places()) places.emplace(place, 0);
    if (places.size() > GUEST_FOCUS_PLACES)
        return {PC_ERROR_CHAIN,
                concat("focus_at: the chain has ", places.size(), " places; at most ",
                       GUEST_FOCUS_PLACES, " can be followed")};
    return {};
}

Focus::Followed& Focus::find(uint64_t chain, const Depths& places) {
    auto found = std::find_if(chains_.begin(), chains_.end(),
                              [&](const Followed& one) { return one.chain == chain; });
    if (found == chains_.end()) {
        if (chains_.size() < kMaxChains) {
            chains_.push_back({chain, chains_.size(), places});
            return chains_.back();
        }
        found = chains_.begin();
        found->chain = chain;
        found->known = false;
        found->depths.clear();
    }
    std::rotate(found, found + 1, chains_.end());
    Followed& followed = chains_.back();
    const auto same = [](const auto& a, const auto& b) { return a.first == b.first; };
    if (std::equal(followed.depths.begin(), followed.depths.end(), places.begin(), places.end(),
                   same))
        return followed;
    Depths moved = places;
    move_from(followed.depths, moved);
    followed.known = followed.known && !followed.depths.empty();
    followed.depths = std::move(moved);
    for (Slot& slot : followed.slots) slot.pending = false;
    return followed;
}

const Focus::Depths& Focus::now(uint64_t chain, const Depths& places) {
    return find(chain, places).depths;
}

Failure Focus::prepare(const HostFrame& frame, gl::TexturePool& pool, gl::ProgramCache& programs,
                       gl::RunObjects& run) {
    if (buffer_ == 0) {
        constexpr GLbitfield kAccess =
            GL_MAP_READ_BIT | GL_MAP_PERSISTENT_BIT | GL_MAP_COHERENT_BIT;
        glCreateBuffers(1, &buffer_);
        glNamedBufferStorage(buffer_, sizeof(Region) * kMaxChains, nullptr, kAccess);
        mapped_ = static_cast<const Region*>(
            glMapNamedBufferRange(buffer_, 0, sizeof(Region) * kMaxChains, kAccess));
        if (!mapped_) {
            glDeleteBuffers(1, &buffer_);
            buffer_ = 0;
            return {PC_ERROR_MEMORY, gl::check_error("allocating the depths in focus").message()};
        }
    }
    if (step_ && array_ == frame.depth.array) return {};
    step_.reset();
    ASSIGN_OR_RETURN(auto made,
                     gl::CompiledPlan::make(one_step(program(frame)), pool, programs, run, false));
    step_.emplace(std::move(made));
    array_ = frame.depth.array;
    step_->import(kDepth, frame.depth.name);
    step_->import(kFound, buffer_);
    step_->warm_up(run, 0);  // with no places
    return {};
}

Status Focus::follow(uint64_t chain, const Depths& places, const HostFrame& frame,
                     gl::RunObjects& run) {
    Followed& followed = find(chain, places);
    const size_t newest = followed.next;
    followed.next = (newest + 1) % kSlots;
    Slot& slot = followed.slots[newest];
    slot.fence.wait();
    shared::GuestUniforms uniforms = uniforms_of(frame);
    set_places(places, frame, uniforms);
    uniforms.focus_slot = int(followed.region * kSlots + newest);
    step_->import(kDepth, frame.depth.name);
    step_->import(kFound, buffer_);
    step_->set_uniforms(0, std::as_bytes(std::span(&uniforms, 1)));
    RETURN_IF_ERROR(step_->run(run));
    glMemoryBarrier(GL_CLIENT_MAPPED_BUFFER_BARRIER_BIT);
    slot.fence = gl::Fence::here();
    slot.pending = true;

    const bool begins = !followed.known || frame.flag(PC_CAMERA_CUT);
    if (begins) slot.fence.wait();
    // Its own depth otherwise counts from the next frame on, however quick the device is.
    const Values* target = nullptr;
    for (size_t age = begins ? 0 : 1; age < kSlots && !target; ++age) {
        const size_t at = (newest + kSlots - age) % kSlots;
        if (followed.slots[at].pending && followed.slots[at].fence.passed())
            target = &mapped_[followed.region][at];
    }
    if (!target) return Status();
    const double seconds = double(frame.given->focus_seconds);
    const double part =
        begins || seconds == 0 ? 1 : -std::expm1(-double(frame.given->frame_seconds) / seconds);
    size_t i = 0;
    for (auto& entry : followed.depths) {
        entry.second += part * (double((*target)[i]) - entry.second);
        ++i;
    }
    followed.known = true;
    return Status();
}

}  // namespace postchain::guest
