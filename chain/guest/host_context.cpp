#include "chain/guest/host_context.h"

#include <epoxy/gl.h>

namespace postchain::guest {
Failure check_version() {
    if (epoxy_is_desktop_gl() && epoxy_gl_version() >= 45) return {};
    const auto* words = reinterpret_cast<const char*>(glGetString(GL_VERSION));
    return {PC_ERROR_CONTEXT, concat("the current context is \"", words ? words : "unknown",
                                     "\"; ask for OpenGL 4.5 core or later when it is made")};
}

GlState::Buffer GlState::buffer_at(unsigned binding, unsigned start, unsigned size,
                                   unsigned index) {
    Buffer buffer;
    glGetIntegeri_v(binding, index, &buffer.name);
    glGetInteger64i_v(start, index, &buffer.start);
    glGetInteger64i_v(size, index, &buffer.size);
    return buffer;
}

// A size of 0 means that the whole buffer is bound.
void GlState::bind(unsigned target, unsigned index, const Buffer& buffer) {
    if (buffer.name == 0 || buffer.size == 0)
        glBindBufferBase(target, index, GLuint(buffer.name));
    else
        glBindBufferRange(target, index, GLuint(buffer.name), GLintptr(buffer.start),
                          GLsizeiptr(buffer.size));
}

void GlState::save(const gl::UsedUnits& used, bool arrays) {
    used_ = used;
    arrays_ = arrays;
    glGetIntegerv(GL_CURRENT_PROGRAM, &program_);
    glGetIntegerv(GL_UNIFORM_BUFFER_BINDING, &uniform_buffer_);
    uniform_ =
        buffer_at(GL_UNIFORM_BUFFER_BINDING, GL_UNIFORM_BUFFER_START, GL_UNIFORM_BUFFER_SIZE, 0);
    if (used.lists > 0) {
        glGetIntegerv(GL_SHADER_STORAGE_BUFFER_BINDING, &storage_buffer_);
        glGetIntegerv(GL_DISPATCH_INDIRECT_BUFFER_BINDING, &indirect_buffer_);
        for (int i = 0; i < used.lists; ++i)
            storage_[size_t(i)] =
                buffer_at(GL_SHADER_STORAGE_BUFFER_BINDING, GL_SHADER_STORAGE_BUFFER_START,
                          GL_SHADER_STORAGE_BUFFER_SIZE, unsigned(i));
    }
    glGetIntegerv(GL_ACTIVE_TEXTURE, &active_texture_);
    for (int i = 0; i < used.textures; ++i) {
        glActiveTexture(GLenum(GL_TEXTURE0 + i));
        glGetIntegerv(GL_TEXTURE_BINDING_2D, &textures_[size_t(i)]);
        if (arrays) glGetIntegerv(GL_TEXTURE_BINDING_2D_ARRAY, &array_textures_[size_t(i)]);
        glGetIntegerv(GL_SAMPLER_BINDING, &samplers_[size_t(i)]);
    }
    glActiveTexture(GLenum(active_texture_));
    for (int i = 0; i < used.images; ++i) {
        Image& image = images_[size_t(i)];
        const auto read = [&](GLenum what, int& value) {
            glGetIntegeri_v(what, GLuint(i), &value);
        };
        read(GL_IMAGE_BINDING_NAME, image.name);
        read(GL_IMAGE_BINDING_LEVEL, image.level);
        read(GL_IMAGE_BINDING_LAYERED, image.layered);
        read(GL_IMAGE_BINDING_LAYER, image.layer);
        read(GL_IMAGE_BINDING_ACCESS, image.access);
        read(GL_IMAGE_BINDING_FORMAT, image.format);
    }
}

void GlState::restore() const {
    const bool deleted = program_ != 0 && !glIsProgram(GLuint(program_));  // when its use ended
    glUseProgram(deleted ? 0 : GLuint(program_));
    bind(GL_UNIFORM_BUFFER, 0, uniform_);
    glBindBuffer(GL_UNIFORM_BUFFER, GLuint(uniform_buffer_));
    if (used_.lists > 0) {
        for (int i = 0; i < used_.lists; ++i)
            bind(GL_SHADER_STORAGE_BUFFER, GLuint(i), storage_[size_t(i)]);
        glBindBuffer(GL_SHADER_STORAGE_BUFFER, GLuint(storage_buffer_));
        glBindBuffer(GL_DISPATCH_INDIRECT_BUFFER, GLuint(indirect_buffer_));
    }
    for (int i = 0; i < used_.textures; ++i) {
        // By target: glBindTextureUnit(i, 0) would unbind the unit's other targets too.
        glActiveTexture(GLenum(GL_TEXTURE0 + i));
        glBindTexture(GL_TEXTURE_2D, GLuint(textures_[size_t(i)]));
        if (arrays_) glBindTexture(GL_TEXTURE_2D_ARRAY, GLuint(array_textures_[size_t(i)]));
        glBindSampler(GLuint(i), GLuint(samplers_[size_t(i)]));
    }
    glActiveTexture(GLenum(active_texture_));
    for (int i = 0; i < used_.images; ++i) {
        const Image& image = images_[size_t(i)];
        glBindImageTexture(GLuint(i), GLuint(image.name), image.level, GLboolean(image.layered),
                           image.layer, GLenum(image.access), GLenum(image.format));
    }
}

void GlState::reset(const gl::UsedUnits& used) {
    glUseProgram(0);
    glBindBufferBase(GL_UNIFORM_BUFFER, 0, 0);
    for (int i = 0; i < used.lists; ++i) glBindBufferBase(GL_SHADER_STORAGE_BUFFER, GLuint(i), 0);
    if (used.lists > 0) glBindBuffer(GL_DISPATCH_INDIRECT_BUFFER, 0);
    for (int i = 0; i < used.textures; ++i) {
        glBindTextureUnit(GLuint(i), 0);
        glBindSampler(GLuint(i), 0);
    }
    for (int i = 0; i < used.images; ++i)
        glBindImageTexture(GLuint(i), 0, 0, GL_FALSE, 0, GL_READ_ONLY, GL_R8);
}

}  // namespace postchain::guest
