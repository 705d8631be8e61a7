// The GL objects that every plan of a context runs with: a sampler, and one buffer for the
// uniform blocks of a frame. It stays mapped, and frames follow each other in it, so that one that
// is filled does not wait for the one that is drawn.
#pragma once

#include <array>
#include <cstddef>
#include <span>

#include "chain/base/status.h"
#include "chain/gl/fence.h"

namespace postchain::gl {

class RunObjects {
  public:
    RunObjects();
    ~RunObjects();
    RunObjects(const RunObjects&) = delete;
    RunObjects& operator=(const RunObjects&) = delete;

    // Reserves room for frames of this many bytes; makes a new buffer if it was smaller. Errors:
    // StatusCode::memory.
    Status reserve(size_t bytes);
    // Puts a frame's blocks after the last frame's and returns their offset. At most the reserved
    // size.
    size_t upload(std::span<const std::byte> bytes);
    unsigned buffer() const { return buffer_; }
    // Offsets of blocks are multiples of this.
    size_t alignment() const { return alignment_; }
    // Nearest, clamps to the edge. No linear one: devices round its weights as they like.
    unsigned sampler() const { return sampler_; }
    // Its objects went with their context.
    void abandon();

  private:
    // A part is used again when the device has passed its fence: one for several frames.
    static constexpr size_t kParts = 3, kFramesOfPart = 4;
    unsigned buffer_ = 0;
    std::byte* mapped_ = nullptr;
    size_t frame_bytes_ = 0;
    size_t frame_ = 0;
    std::array<Fence, kParts> fences_;
    size_t alignment_;
    unsigned sampler_;
};

}  // namespace postchain::gl
