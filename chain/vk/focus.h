// The depths at the places that chains focus at (`focus_at`), found by a step of each run.
//
// It writes them to a buffer that the host sees, at the place of its run among the runs in flight.
// They are read when a later run takes that place: it is over then, so nothing waits.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "chain/guest/followed_depths.h"
#include "chain/vk/image_pool.h"

namespace postchain::vk {

class Focus {
  public:
    Focus(const Device& device, uint32_t runs_in_flight)
        : device_(device), found_(device), runs_(runs_in_flight) {}

    // The buffer, made at its first use. Errors: StatusCode::memory.
    Status make_buffer();
    // A work list that the plans import.
    const Image& buffer() const { return found_; }

    // The chain's depths before run number `next`.
    const guest::Depths& now(uint64_t chain, const guest::Depths& places, uint64_t next) {
        return chains_.find(chain, places, next).depths;
    }
    // Reads the depths of the run whose place run number `run` takes.
    void take_place(uint64_t run);
    // The chain's depths in that run. While none is known, at first and after a cut: those of
    // `distance`, in scene units, if it is > 0.
    const guest::Depths& follow(uint64_t chain, const guest::Depths& places, const pc_frame& given,
                                double distance, uint64_t run);
    // That run was recorded, with the step of the chain that was followed last.
    void begin(uint64_t run) { runs_[run % runs_.size()] = {now_, run}; }
    // Recorded runs are never submitted.
    void forget_runs() { runs_.assign(runs_.size(), {}); }

  private:
    struct Run {
        size_t number = 0;  // of its chain
        uint64_t run = 0;   // 0: none
    };
    struct Found {
        uint64_t run = 0;  // 0: none
        guest::FoundDepths depths = {};
    };

    const Device& device_;
    Image found_;
    guest::FollowedChains chains_;
    std::array<Found, guest::FollowedChains::kMost> newest_ = {};  // of each chain's number
    std::vector<Run> runs_;                                        // of each place
    size_t now_ = 0;
};

}  // namespace postchain::vk
