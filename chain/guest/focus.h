// The depths at the places that a chain's passes focus at (`focus_at`), found on the device and
// followed over time.
//
// In every frame a step writes the depth at each place to a mapped buffer. It is used when the
// device has come so far, from the next frame on, so that no frame waits: only a chain's first
// frame and one after a cut do, because they have nothing to go by.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <vector>

#include "chain/gl/compiled_plan.h"
#include "chain/gl/fence.h"
#include "chain/guest/chain_handle.h"
#include "chain/guest/host_frame.h"

namespace postchain::guest {

class Focus {
  public:
    using Depths = std::map<Place, double>;  // inverse depths, 1/scene units

    ~Focus();
    // The program of its step.
    static ProgramKey program(const HostFrame& frame);
    // The places of a chain, each once. PC_ERROR_CHAIN: more than GUEST_FOCUS_PLACES.
    static Failure find_places(const Chain& chain, Depths& places);

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
    // A frame's depths, in the order of the places.
    struct Slot {
        gl::Fence fence;
        bool pending = false;
    };
    // A device may be as many of a chain's frames behind.
    static constexpr size_t kSlots = 8;
    struct Followed {
        uint64_t chain = 0;
        size_t region = 0;  // of the buffer
        Depths depths;
        bool known = false;
        std::array<Slot, kSlots> slots = {};
        size_t next = 0;
    };
    using Values = std::array<float, GUEST_FOCUS_PLACES>;
    using Region = std::array<Values, kSlots>;
    static constexpr size_t kMaxChains = 64;

    Followed& find(uint64_t chain, const Depths& places);

    unsigned buffer_ = 0;
    const Region* mapped_ = nullptr;  // kMaxChains
    std::optional<gl::CompiledPlan> step_;
    bool array_ = false;            // of the step
    std::vector<Followed> chains_;  // the one that ran last is the last
};

}  // namespace postchain::guest
