// The sizes of frame for which an instance makes its textures: the size that the host stated, or
// the largest frame seen, so that smaller frames cost values alone.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "chain/guest/host_frame.h"
#include "chain/plan/storage.h"

namespace postchain::guest {

class MaxFrameSizes {
  public:
    MaxFrameSizes() = default;
    // `stated`: 0 x 0 = none. `kept`: frames after which textures shrink.
    MaxFrameSizes(MaxFrameSize stated, uint64_t kept);

    // The size for a frame of the chain. `runs`: the frame is filtered, not only prepared.
    MaxFrameSize size_for(uint64_t chain, const HostFrame& frame, bool runs);
    // That of a frame that did not run, for its needs.
    MaxFrameSize expected(const HostFrame& frame) const;
    // No memory was left for the size of size_for(). The chain's frames get textures of their own
    // size, `tight`, if these fitted.
    void fall_back(uint64_t chain, MaxFrameSize tight, bool fitted);
    // The chain was prepared anew: it gets the stated size again.
    void restore(uint64_t chain);

  private:
    static constexpr size_t kMaxTight = 8;
    bool is_stated() const { return stated_.width > 0; }

    MaxFrameSize stated_;
    uint64_t kept_ = 0;
    MaxFrameSize largest_;  // the largest frame stated or seen
    // The newest frames of at most half its sides, or of the stated size.
    uint64_t small_frames_ = 0;
    MaxFrameSize small_;  // the largest of them
    // Chains whose textures of the stated size exceed the budget, the newest last, and the size
    // that they get.
    std::vector<uint64_t> tight_chains_;
    MaxFrameSize tight_;
};

}  // namespace postchain::guest
