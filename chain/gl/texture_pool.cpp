#include "chain/gl/texture_pool.h"

#include <epoxy/gl.h>

#include <algorithm>
#include <iterator>

#include "chain/gl/debug.h"

namespace postchain::gl {
namespace {

struct GlFormat {
    GLenum internal, external;
};

GlFormat gl_format(Format format) {
    static constexpr GlFormat kFormats[] = {{GL_RGBA32F, GL_RGBA},
                                            {GL_RGBA16F, GL_RGBA},
                                            {GL_RG32F, GL_RG},
                                            {GL_RG16F, GL_RG},
                                            {GL_R32F, GL_RED},
                                            {GL_R16F, GL_RED},
                                            {GL_RGBA8, GL_RGBA},
                                            {GL_RG8, GL_RG},
                                            {GL_R8, GL_RED},
                                            {GL_RGBA32UI, GL_RGBA_INTEGER},
                                            {GL_R32UI, GL_RED_INTEGER},
                                            {0, 0}};  // a work list
    static_assert(std::size(kFormats) == size_t(Format::work_list) + 1);
    return kFormats[size_t(format)];
}

// True if the texture has storage now. GL's error flag is not read: it is the host's.
bool create(Texture& texture) {
    GLint made = GL_FALSE;
    if (texture.format == Format::work_list) {
        glCreateBuffers(1, &texture.name);
        glNamedBufferStorage(texture.name, GLsizeiptr(texture.bytes()), nullptr, 0);
        glGetNamedBufferParameteriv(texture.name, GL_BUFFER_IMMUTABLE_STORAGE, &made);
        return made == GL_TRUE;
    }
    const GLenum internal = gl_format(texture.format).internal;
    if (texture.slices > 0) {
        glCreateTextures(GL_TEXTURE_2D_ARRAY, 1, &texture.name);
        glTextureStorage3D(texture.name, 1, internal, texture.width, texture.height,
                           texture.slices);
    } else {
        glCreateTextures(GL_TEXTURE_2D, 1, &texture.name);
        glTextureStorage2D(texture.name, 1, internal, texture.width, texture.height);
    }
    glGetTextureParameteriv(texture.name, GL_TEXTURE_IMMUTABLE_FORMAT, &made);
    return made == GL_TRUE;
}

void destroy(const Texture& texture) {
    if (texture.format == Format::work_list)
        glDeleteBuffers(1, &texture.name);
    else
        glDeleteTextures(1, &texture.name);
}

}  // namespace

unsigned internal_format(Format format) {
    return gl_format(format).internal;
}

unsigned external_format(Format format) {
    return gl_format(format).external;
}

TexturePool::~TexturePool() {
    for (const auto& texture : textures_) destroy(*texture);
}

Result<Texture*> TexturePool::acquire(const Storage& storage, bool apart) {
    for (const auto& texture : textures_) {
        if (texture->in_use || (apart && texture->plans > 0) || *texture != storage) continue;
        texture->in_use = true;
        texture->last_used = frame_;
        return texture.get();
    }
    const std::string doing = "allocating a texture of " + storage.text();
    GLint limit = 0;
    glGetIntegerv(GL_MAX_TEXTURE_SIZE, &limit);
    if (storage.format != Format::work_list && std::max(storage.width, storage.height) > limit)
        return Status(StatusCode::gl, concat(doing, ": this device's limit is ", limit,
                                             " a side; use smaller frames"));
    GLint most_slices = 0;
    glGetIntegerv(GL_MAX_ARRAY_TEXTURE_LAYERS, &most_slices);
    if (storage.slices > most_slices)
        return Status(StatusCode::gl, concat(doing, ": this device's limit is ", most_slices,
                                             " slices; use fewer layers"));
    auto texture = std::make_unique<Texture>(Texture{storage});
    texture->in_use = true;
    texture->last_used = frame_;
    if (budget_ > 0 && bytes_ + texture->bytes() > budget_)
        return Status(StatusCode::memory,
                      concat(doing, ": ", bytes_, " bytes are in use, and the budget is ", budget_,
                             "; raise it, or use smaller frames"));
    if (!create(*texture)) {
        destroy(*texture);
        return Status(StatusCode::memory, check_error(doing).message());
    }
    ++allocations_;
    bytes_ += texture->bytes();
    bytes_peak_ = std::max(bytes_peak_, bytes_);
    textures_.push_back(std::move(texture));
    return textures_.back().get();
}

void TexturePool::release(Texture* texture) {
    texture->in_use = false;
}

void TexturePool::begin_frame() {
    ++frame_;
}

void TexturePool::trim(uint64_t frames) {
    std::erase_if(textures_, [&](const auto& texture) {
        if (texture->plans > 0 || !unused(*texture, frames)) return false;
        bytes_ -= texture->bytes();
        destroy(*texture);
        return true;
    });
}

void clear(Texture& texture) {
    texture.filled = true;
    if (texture.format == Format::work_list) return empty_list(texture.name);
    const bool whole = texture.format == Format::rgba32ui || texture.format == Format::r32ui;
    glClearTexImage(texture.name, 0, external_format(texture.format),
                    whole ? GL_UNSIGNED_INT : GL_FLOAT, nullptr);
}

void empty_list(unsigned list) {
    glClearNamedBufferSubData(list, GL_R32UI, 0, GLsizeiptr(kWorkListHeaderBytes), GL_RED_INTEGER,
                              GL_UNSIGNED_INT, nullptr);
}

unsigned count_work(unsigned list) {
    GLuint count = 0;
    glGetNamedBufferSubData(list, 3 * sizeof(GLuint), sizeof(count), &count);
    return count;
}

}  // namespace postchain::gl
