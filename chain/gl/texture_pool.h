// Textures and work lists by (format, width, height), acquired and released by the executor;
// nothing is freed until the pool is trimmed, so that the second frame of a size allocates nothing.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "chain/gl/device.h"
#include "chain/image.h"
#include "chain/plan.h"
#include "chain/status.h"

namespace postchain::gl {

// GL's name of a format: of texture storage and of image bindings.
unsigned internal_format(Format format);

struct Texture {
    unsigned name = 0;  // GL texture, immutable storage, one level; of a work list: a GL buffer
    Format format = Format::rgba32f;
    int width = 0;
    int height = 0;
    bool in_use = false;
    uint64_t last_used = 0;
};

class TexturePool {
  public:
    explicit TexturePool(LogCallback log = {}) : log_(std::move(log)) {}
    ~TexturePool();
    TexturePool(const TexturePool&) = delete;
    TexturePool& operator=(const TexturePool&) = delete;
    // A texture of undefined content, or an empty work list. StatusCode::gl when memory or the size
    // limit is exceeded. Where a texture has to be made, an error that was pending before goes to
    // the log.
    Result<Texture*> acquire(Format format, int width, int height);
    void release(Texture* texture);
    void begin_frame();
    // Deletes the textures that are free and were not acquired in the last `frames` frames.
    void trim(uint64_t frames);

    uint64_t allocations() const { return allocations_; }
    uint64_t alive() const { return textures_.size(); }
    uint64_t bytes_peak() const { return bytes_peak_; }

  private:
    LogCallback log_;
    std::vector<std::unique_ptr<Texture>> textures_;
    uint64_t frame_ = 0;
    uint64_t allocations_ = 0;
    uint64_t bytes_ = 0;
    uint64_t bytes_peak_ = 0;
};

// How many blocks a work list holds. Waits for the device.
unsigned count_work(unsigned list);

// Float pixels to a texture and back; channels must match the texture's format.
Status upload(const Texture& texture, const ImageF& pixels);
Result<ImageF> download(unsigned texture, Format format, int width, int height);

}  // namespace postchain::gl
