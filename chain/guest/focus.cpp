#include "chain/guest/focus.h"

#include <epoxy/gl.h>

#include <span>
#include <utility>

#include "chain/gl/debug.h"

namespace postchain::guest {
namespace {

constexpr TextureId kDepth = 0, kFound = 1;

Plan one_step(const HostFrame& frame) {
    Plan plan;
    plan.passes.push_back({"focus", "", false, {}});
    PlanTexture depth, found;
    depth.name = "host.depth";
    depth.format = Format::r32f;
    found.name = "focus.depths";
    found.format = Format::work_list;
    depth.imported = found.imported = true;
    plan.textures = {depth, found};
    plan.steps.push_back(focus_step(frame, kDepth, kFound));
    find_lifetimes(plan, {});
    return plan;
}

}  // namespace

Focus::~Focus() {
    if (buffer_) glDeleteBuffers(1, &buffer_);
}

void Focus::abandon() {
    for (Ring& ring : rings_)
        for (Slot& slot : ring.slots) slot.fence.abandon();
    buffer_ = 0;
    step_.reset();
}

const Depths& Focus::now(uint64_t chain, const Depths& places) {
    return chains_.find(chain, places, next_).depths;
}

Failure Focus::prepare(const HostFrame& frame, gl::TexturePool& pool, gl::ProgramCache& programs,
                       gl::RunObjects& run) {
    if (buffer_ == 0) {
        constexpr GLbitfield kAccess =
            GL_MAP_READ_BIT | GL_MAP_PERSISTENT_BIT | GL_MAP_COHERENT_BIT;
        glCreateBuffers(1, &buffer_);
        glNamedBufferStorage(buffer_, sizeof(Region) * FollowedChains::kMost, nullptr, kAccess);
        mapped_ = static_cast<const Region*>(
            glMapNamedBufferRange(buffer_, 0, sizeof(Region) * FollowedChains::kMost, kAccess));
        if (!mapped_) {
            glDeleteBuffers(1, &buffer_);
            buffer_ = 0;
            return {PC_ERROR_MEMORY, gl::check_error("allocating the depths in focus").message()};
        }
    }
    if (step_ && array_ == frame.depth.array) return {};
    step_.reset();
    ASSIGN_OR_RETURN(auto made,
                     gl::CompiledPlan::make(one_step(frame), pool, programs, run, false));
    step_.emplace(std::move(made));
    array_ = frame.depth.array;
    step_->import(kDepth, frame.depth.name);
    step_->import(kFound, buffer_);
    step_->warm_up(run, 0);  // with no places
    return {};
}

Status Focus::follow(uint64_t chain, const Depths& places, const HostFrame& frame,
                     gl::RunObjects& run) {
    Followed& followed = chains_.find(chain, places, next_);
    if (frame.flag(PC_CAMERA_CUT)) followed.known = false;
    if (rings_.size() <= followed.number) rings_.resize(followed.number + 1);
    Ring& ring = rings_[followed.number];
    const size_t newest = ring.next;
    ring.next = (newest + 1) % kSlots;
    Slot& slot = ring.slots[newest];
    slot.fence.wait();
    shared::GuestUniforms uniforms = uniforms_of(frame);
    uniforms.focus_slot = int(followed.number * kSlots + newest);
    step_->import(kDepth, frame.depth.name);
    step_->import(kFound, buffer_);
    step_->set_uniforms(0, std::as_bytes(std::span(&uniforms, 1)));
    RETURN_IF_ERROR(step_->run(run));
    glMemoryBarrier(GL_CLIENT_MAPPED_BUFFER_BARRIER_BIT);
    slot.fence = gl::Fence::here();
    slot.frame = next_++;

    if (!followed.known) slot.fence.wait();
    // Its own depth otherwise counts from the next frame on, however quick the device is.
    for (size_t age = followed.known ? 1 : 0; age < kSlots; ++age) {
        const size_t at = (newest + kSlots - age) % kSlots;
        if (ring.slots[at].frame < followed.since || !ring.slots[at].fence.passed()) continue;
        followed.approach(mapped_[followed.number][at], *frame.given);
        break;
    }
    return Status();
}

}  // namespace postchain::guest
