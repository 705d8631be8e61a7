#include "chain/gl/run_objects.h"

#include <epoxy/gl.h>

#include <cstring>

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
    mapped_ = nullptr;
    sampler_ = 0;
    for (Fence& fence : fences_) fence.abandon();
}

Status RunObjects::reserve(size_t bytes) {
    bytes = (bytes + alignment() - 1) / alignment() * alignment();
    if (bytes <= frame_bytes_) return Status();
    constexpr GLbitfield kAccess = GL_MAP_WRITE_BIT | GL_MAP_PERSISTENT_BIT;
    const auto all = GLsizeiptr(kParts * kFramesOfPart * bytes);
    unsigned made = 0;
    glCreateBuffers(1, &made);
    glNamedBufferStorage(made, all, nullptr, kAccess);
    void* mapped = glMapNamedBufferRange(made, 0, all, kAccess | GL_MAP_FLUSH_EXPLICIT_BIT);
    if (!mapped) {
        glDeleteBuffers(1, &made);
        return Status(StatusCode::memory, check_error("allocating uniform blocks").message());
    }
    if (buffer_) glDeleteBuffers(1, &buffer_);
    buffer_ = made;
    mapped_ = static_cast<std::byte*>(mapped);
    frame_bytes_ = bytes;
    for (Fence& fence : fences_) fence = Fence();
    return Status();
}

size_t RunObjects::upload(std::span<const std::byte> bytes) {
    const size_t part = frame_ / kFramesOfPart;
    frame_ = (frame_ + 1) % (kParts * kFramesOfPart);
    if (const size_t next = frame_ / kFramesOfPart; next != part) {
        fences_[part] = Fence::here();
        fences_[next].wait();
    }
    const size_t offset = frame_ * frame_bytes_;
    if (bytes.empty()) return offset;
    std::memcpy(mapped_ + offset, bytes.data(), bytes.size());
    glFlushMappedNamedBufferRange(buffer_, GLintptr(offset), GLsizeiptr(bytes.size()));
    return offset;
}

}  // namespace postchain::gl
