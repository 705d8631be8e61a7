// The part of a host's GL state that running a plan touches.
#pragma once

#include <array>
#include <cstdint>

#include "chain/gl/compiled_plan.h"

namespace postchain::guest {

// Allocates nothing. save() reads what a plan with these units is about to change, and restore()
// puts it back; reset() sets GL's initial values, and unbinds units as a whole, instead.
class GlState {
  public:
    void save(const gl::UsedUnits& used);
    void restore() const;
    static void reset(const gl::UsedUnits& used);

  private:
    static constexpr size_t kMost = gl::CompiledPlan::kMaxUnits;
    struct Buffer {
        int name;
        int64_t start, size;
    };
    struct Image {
        int name, level, layered, layer, access, format;
    };
    static Buffer buffer_at(unsigned binding, unsigned start, unsigned size, unsigned index);
    static void bind(unsigned target, unsigned index, const Buffer& buffer);

    gl::UsedUnits used_;
    int program_, uniform_buffer_, storage_buffer_, indirect_buffer_, active_texture_;
    Buffer uniform_;
    std::array<Buffer, kMost> storage_;
    std::array<int, kMost> textures_, samplers_;
    std::array<Image, kMost> images_;
};

}  // namespace postchain::guest
