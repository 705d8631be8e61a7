#include "chain/gl/run_objects.h"

#include <epoxy/gl.h>

#include "chain/gl/debug.h"

namespace postchain::gl {

namespace {

unsigned make_sampler() {
    GLuint sampler = 0;
    glCreateSamplers(1, &sampler);
    glSamplerParameteri(sampler, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
    glSamplerParameteri(sampler, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
    glSamplerParameteri(sampler, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
    glSamplerParameteri(sampler, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
    return sampler;
}

size_t block_alignment() {
    GLint least = 0;
    glGetIntegerv(GL_UNIFORM_BUFFER_OFFSET_ALIGNMENT, &least);
    return size_t(least > 16 ? least : 16);
}

}  // namespace

RunObjects::RunObjects() : alignment_(block_alignment()), sampler_(make_sampler()) {}

RunObjects::~RunObjects() {
    if (buffer_) glDeleteBuffers(1, &buffer_);
    if (sampler_) glDeleteSamplers(1, &sampler_);
}

void RunObjects::abandon() {
    buffer_ = 0;
    sampler_ = 0;
}

Status RunObjects::reserve(size_t bytes) {
    bytes = (bytes + alignment() - 1) / alignment() * alignment();
    if (bytes <= frame_bytes_) return Status();
    unsigned made = 0;
    glCreateBuffers(1, &made);
    glNamedBufferStorage(made, GLsizeiptr(kFrames * bytes), nullptr, GL_DYNAMIC_STORAGE_BIT);
    GLint stored = GL_FALSE;
    glGetNamedBufferParameteriv(made, GL_BUFFER_IMMUTABLE_STORAGE, &stored);
    if (!stored) {
        glDeleteBuffers(1, &made);
        return Status(StatusCode::memory, check_error("allocating uniform blocks").message());
    }
    if (buffer_) glDeleteBuffers(1, &buffer_);
    buffer_ = made;
    frame_bytes_ = bytes;
    return Status();
}

size_t RunObjects::upload(std::span<const std::byte> bytes) {
    frame_ = (frame_ + 1) % kFrames;
    const size_t offset = frame_ * frame_bytes_;
    if (!bytes.empty())
        glNamedBufferSubData(buffer_, GLintptr(offset), GLsizeiptr(bytes.size()), bytes.data());
    return offset;
}

}  // namespace postchain::gl
