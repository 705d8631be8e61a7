// Planes to textures and back, in pieces by way of buffers that stay mapped: the device copies some
// while others are converted. A software renderer copies within the call, from and to plain memory.
#pragma once

#include <cstddef>
#include <vector>

#include "chain/base/image.h"
#include "chain/base/status.h"
#include "chain/gl/fence.h"
#include "chain/gl/texture_pool.h"
#include "chain/plan/plan.h"

namespace postchain::gl {

// Pieces of a buffer, one after another, each with what the device does with it.
class PixelRing {
  public:
    static constexpr size_t kPieceBytes = size_t(1) << 20;

    PixelRing() = default;
    ~PixelRing();
    PixelRing(const PixelRing&) = delete;
    PixelRing& operator=(const PixelRing&) = delete;

    Status make(bool plain);                     // once
    unsigned buffer() const { return buffer_; }  // 0: plain memory
    size_t pieces() const { return fences_.size(); }
    // Number of pieces from its first one on.
    std::byte* piece(size_t number) { return memory_ + offset(number); }
    // As GL takes it.
    void* place(size_t number) {
        return buffer_ ? reinterpret_cast<void*>(offset(number)) : piece(number);
    }
    Fence& fence(size_t number) { return fences_[number % pieces()]; }

  private:
    size_t offset(size_t number) const { return number % pieces() * kPieceBytes; }

    unsigned buffer_ = 0;
    std::byte* memory_ = nullptr;
    std::vector<std::byte> plain_;
    std::vector<Fence> fences_;
};

// A plane on its way to a texture: float pixels, whose channels match the texture's format. The
// slices of an array lie one below another.
struct Upload {
    const Texture* texture = nullptr;
    const ImageF* pixels = nullptr;
    int row = 0;  // the first that is not yet handed over, over all slices
};

class Transfers {
  public:
    explicit Transfers(bool software = false) : software_(software) {}
    // Hands over the next piece if that needs no wait. False: it needs one, or there is none.
    bool advance(Upload& upload);
    // Hands over all that is left.
    Status finish(Upload& upload);
    Status upload(const Texture& texture, const ImageF& pixels);
    // `texture`: GL's name.
    Result<ImageF> download(unsigned texture, const Storage& storage,
                            const Meanwhile& meanwhile = {});

  private:
    void hand_over(Upload& upload);

    const bool software_;
    PixelRing up_, down_;
    size_t next_up_ = 0, next_down_ = 0;
};

}  // namespace postchain::gl
