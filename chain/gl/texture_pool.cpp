#include "chain/gl/texture_pool.h"

#include <epoxy/gl.h>

#include <algorithm>

#include "chain/gl/debug.h"

namespace postchain::gl {
namespace {

struct GlFormat {
    GLenum internal, external;
};

GlFormat gl_format(Format format) {
    switch (format) {
        case Format::rgba32f:
            return {GL_RGBA32F, GL_RGBA};
        case Format::rgba16f:
            return {GL_RGBA16F, GL_RGBA};
        case Format::rg32f:
            return {GL_RG32F, GL_RG};
        case Format::rg16f:
            return {GL_RG16F, GL_RG};
        case Format::r32f:
            return {GL_R32F, GL_RED};
        case Format::r16f:
            return {GL_R16F, GL_RED};
        case Format::rgba8:
            return {GL_RGBA8, GL_RGBA};
        case Format::rg8:
            return {GL_RG8, GL_RG};
        case Format::r8:
            return {GL_R8, GL_RED};
        case Format::rgba32ui:
            return {GL_RGBA32UI, GL_RGBA_INTEGER};
        case Format::r32ui:
            return {GL_R32UI, GL_RED_INTEGER};
        case Format::work_list:
            break;
    }
    return {0, 0};
}

uint64_t bytes_of(const Texture& texture) {
    PlanTexture like;
    like.format = texture.format;
    like.width = texture.width;
    like.height = texture.height;
    like.layers = texture.layers;
    return like.bytes();
}

// True if the texture has storage now. GL's error flag is not read: it is the host's.
bool create(Texture& texture) {
    GLint made = GL_FALSE;
    if (texture.format == Format::work_list) {
        glCreateBuffers(1, &texture.name);
        glNamedBufferStorage(texture.name, GLsizeiptr(bytes_of(texture)), nullptr, 0);
        glGetNamedBufferParameteriv(texture.name, GL_BUFFER_IMMUTABLE_STORAGE, &made);
        return made == GL_TRUE;
    }
    const GLenum internal = gl_format(texture.format).internal;
    if (texture.layers > 0) {
        glCreateTextures(GL_TEXTURE_2D_ARRAY, 1, &texture.name);
        glTextureStorage3D(texture.name, 1, internal, texture.width, texture.height,
                           texture.layers);
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

Result<Texture*> TexturePool::acquire(Format format, int width, int height, int layers,
                                      bool apart) {
    for (const auto& texture : textures_) {
        if (texture->in_use || (apart && texture->plans > 0) || texture->format != format ||
            texture->width != width || texture->height != height || texture->layers != layers)
            continue;
        texture->in_use = true;
        texture->last_used = frame_;
        return texture.get();
    }
    const std::string doing =
        concat("allocating a texture of ", width, "x", height,
               layers > 0 ? concat("x", layers) : std::string(), " ", name_of(format));
    GLint limit = 0;
    glGetIntegerv(GL_MAX_TEXTURE_SIZE, &limit);
    if (format != Format::work_list && (width > limit || height > limit))
        return Status(StatusCode::gl, concat(doing, ": this device's limit is ", limit, " a side"));
    GLint most_layers = 0;
    glGetIntegerv(GL_MAX_ARRAY_TEXTURE_LAYERS, &most_layers);
    if (layers > most_layers)
        return Status(StatusCode::gl,
                      concat(doing, ": this device's limit is ", most_layers, " layers"));
    auto texture = std::make_unique<Texture>();
    texture->format = format;
    texture->width = width;
    texture->height = height;
    texture->layers = layers;
    texture->in_use = true;
    texture->last_used = frame_;
    if (budget_ > 0 && bytes_ + bytes_of(*texture) > budget_)
        return Status(StatusCode::memory, concat(doing, ": ", bytes_,
                                                 " bytes are in use, and the budget is ", budget_));
    if (!create(*texture)) {
        destroy(*texture);
        return Status(StatusCode::memory, check_error(doing).message());
    }
    ++allocations_;
    bytes_ += bytes_of(*texture);
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
        bytes_ -= bytes_of(*texture);
        destroy(*texture);
        return true;
    });
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
