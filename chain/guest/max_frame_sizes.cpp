#include "chain/guest/max_frame_sizes.h"

#include <algorithm>

namespace postchain::guest {
namespace {

MaxFrameSize half_of(const MaxFrameSize& max_size) {
    return {(max_size.width + 1) / 2, (max_size.height + 1) / 2};
}

MaxFrameSize larger(const MaxFrameSize& a, const MaxFrameSize& b) {
    return {std::max(a.width, b.width), std::max(a.height, b.height)};
}

MaxFrameSize own_of(const HostFrame& frame) {
    return {frame.plane_width(), frame.plane_height()};
}

}  // namespace

MaxFrameSizes::MaxFrameSizes(MaxFrameSize stated, uint64_t kept)
    : stated_(stated), kept_(kept), largest_(stated), small_(stated) {}

MaxFrameSize MaxFrameSizes::size_for(uint64_t chain, const HostFrame& frame, bool runs) {
    const MaxFrameSize own = own_of(frame);
    const bool tight =
        std::find(tight_chains_.begin(), tight_chains_.end(), chain) != tight_chains_.end();
    if (frame.halved() && !tight) return larger(own, half_of(stated_));
    // A texture that the host gets has the size of its frame, unless it stated another.
    if (frame.output.name == 0 && !is_stated()) return own;
    if (tight) return tight_ = larger(tight_, own);
    const bool small = is_stated()
                           ? larger(stated_, own) == stated_
                           : 2 * own.width <= largest_.width && 2 * own.height <= largest_.height;
    if (!small) {
        small_frames_ = 0;
        small_ = stated_;
    } else if (runs) {
        small_ = larger(small_, own);
        if (++small_frames_ > kept_) largest_ = small_;
    }
    largest_ = larger(largest_, own);
    return largest_;
}

MaxFrameSize MaxFrameSizes::expected(const HostFrame& frame) const {
    const MaxFrameSize own = own_of(frame);
    if (frame.halved()) return larger(own, half_of(stated_));
    return frame.output.name != 0 || is_stated() ? larger(own, largest_) : own;
}

void MaxFrameSizes::fall_back(uint64_t chain, MaxFrameSize tight, bool fitted) {
    largest_ = is_stated() || !fitted ? stated_ : tight;
    if (!fitted || !is_stated()) return;
    std::erase(tight_chains_, chain);
    tight_chains_.push_back(chain);
    if (tight_chains_.size() > kMaxTight) tight_chains_.erase(tight_chains_.begin());
    tight_ = tight;
}

void MaxFrameSizes::restore(uint64_t chain) {
    std::erase(tight_chains_, chain);
}

}  // namespace postchain::guest
