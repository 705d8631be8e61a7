// The depths at the places that a chain's passes focus at (`focus_at`), found by GL and followed
// over time.
//
// In every frame a step writes the depth at each place to a mapped buffer. It is used when the
// device has come so far, from the next frame on, so that no frame waits: only a chain's first
// frame and one after a cut do, because they have nothing to go by.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "chain/gl/compiled_plan.h"
#include "chain/gl/fence.h"
#include "chain/guest/followed_depths.h"
#include "chain/guest/host_frame.h"

namespace postchain::guest {

class Focus {
  public:
    ~Focus();

    // Depths as they are now; 0, infinitely far, before the first frame.
    const Depths& now(uint64_t chain, const Depths& places);
    // Makes the step for frames of this kind, and dispatches it once. Errors: those of GL.
    Failure prepare(const HostFrame& frame, gl::TexturePool& pool, gl::ProgramCache& programs,
                    gl::RunObjects& run);
    static constexpr gl::UsedUnits kUsed = {.textures = 2, .images = 0, .lists = 1};
    // Dispatches the step, and brings now() to what is known by then. Precondition: prepare() for
    // this frame, which has depth.
    Status follow(uint64_t chain, const Depths& places, const HostFrame& frame,
                  gl::RunObjects& run);
    // Its objects went with their context.
    void abandon();

  private:
    // The chain's depths of a frame.
    struct Slot {
        gl::Fence fence;
        uint64_t frame = 0;  // 0: none
    };
    // A device may be as many of a chain's frames behind.
    static constexpr size_t kSlots = 8;
    struct Ring {
        std::array<Slot, kSlots> slots = {};
        size_t next = 0;
    };
    using Region = std::array<FoundDepths, kSlots>;

    unsigned buffer_ = 0;
    const Region* mapped_ = nullptr;  // of each chain's number
    std::optional<gl::CompiledPlan> step_;
    bool array_ = false;  // of the step
    FollowedChains chains_;
    std::vector<Ring> rings_;  // of each chain's number
    uint64_t next_ = 1;        // the number of the next frame
};

}  // namespace postchain::guest
