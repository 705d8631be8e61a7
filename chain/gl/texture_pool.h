// Textures and work lists by their storage, acquired and released by the executor; nothing is freed
// until the pool is trimmed, so that the second frame of a size allocates nothing.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "chain/base/status.h"
#include "chain/plan/plan.h"

namespace postchain::gl {

// GL's name of a format, for texture storage and image bindings.
unsigned internal_format(Format format);
// GL's name of the channels of its pixels.
unsigned external_format(Format format);

struct Texture : Storage {
    unsigned name = 0;  // GL texture, immutable storage, one level; for a work list a GL buffer
    bool in_use = false;
    int plans = 0;        // that are compiled and write into it
    bool filled = false;  // a plan has run on it, or it was cleared
    uint64_t last_used = 0;
};

class TexturePool {
  public:
    TexturePool() = default;
    ~TexturePool();
    TexturePool(const TexturePool&) = delete;
    TexturePool& operator=(const TexturePool&) = delete;
    // A texture of undefined content, or a work list. StatusCode::memory if GL has no memory left
    // or the budget is spent, StatusCode::gl if the size limit is exceeded. GL's error flag is read
    // only if GL refuses, so that no error stays in it. `apart`: not one that a compiled plan,
    // which may run now, writes.
    Result<Texture*> acquire(const Storage& storage, bool apart = false);
    void release(Texture* texture);
    void begin_frame();
    // It is used in this frame, without being acquired again.
    void touch(Texture* texture) { texture->last_used = frame_; }
    bool unused(const Texture& texture, uint64_t frames) const {
        return !texture.in_use && texture.last_used + frames < frame_;
    }
    // Deletes the textures that are free, that no compiled plan writes, and that were not used in
    // the last `frames` frames.
    void trim(uint64_t frames);
    void set_budget(uint64_t bytes) { budget_ = bytes; }  // 0 = none
    // Its textures went with their context.
    void abandon() { textures_.clear(); }

    uint64_t allocations() const { return allocations_; }
    uint64_t alive() const { return textures_.size(); }
    uint64_t bytes() const { return bytes_; }
    uint64_t bytes_peak() const { return bytes_peak_; }

  private:
    std::vector<std::unique_ptr<Texture>> textures_;
    uint64_t frame_ = 0;
    uint64_t budget_ = 0;
    uint64_t allocations_ = 0;
    uint64_t bytes_ = 0;
    uint64_t bytes_peak_ = 0;
};

// Makes all of its bits 0. A list becomes empty.
void clear(Texture& texture);
// Zero groups, zero blocks. The blocks themselves need no clearing.
void empty_list(unsigned list);
// How many blocks a work list holds. Waits for the device.
unsigned count_work(unsigned list);

}  // namespace postchain::gl
