// The host's GL context: its version, and its state, which is as the host left it after each call.
#pragma once

#include <array>
#include <cstdint>

#include "chain/gl/compiled_plan.h"
#include "chain/guest/failure.h"

namespace postchain::guest {

// PC_ERROR_CONTEXT if the current context is not desktop OpenGL 4.5 or later; the text names it.
Failure check_version();

// Allocates nothing. save() reads the state that a plan with these units changes, `arrays`: which
// reads array textures, and restore() sets it again. reset() sets GL's initial values instead, and
// unbinds all targets of the units.
class GlState {
  public:
    void save(const gl::UsedUnits& used, bool arrays);
    void restore() const;
    static void reset(const gl::UsedUnits& used);

  private:
    static constexpr size_t kMax = gl::kMaxUnits;
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
    bool arrays_ = false;
    int program_, uniform_buffer_, storage_buffer_, indirect_buffer_, active_texture_;
    Buffer uniform_;
    std::array<Buffer, kMax> storage_;
    std::array<int, kMax> textures_, array_textures_, samplers_;
    std::array<Image, kMax> images_;
};

}  // namespace postchain::guest
