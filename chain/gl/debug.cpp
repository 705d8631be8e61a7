#include "chain/gl/debug.h"

#include <epoxy/gl.h>

#include <algorithm>

namespace postchain::gl {

Status check_error(const std::string& doing) {
    const GLenum error = glGetError();
    if (error == GL_NO_ERROR) return Status();
    forget_errors();
    if (error == GL_OUT_OF_MEMORY) return Status(StatusCode::gl, doing + ": out of GL memory");
    return Status(StatusCode::gl, concat(doing, ": GL error 0x", std::hex, error));
}

void forget_errors() {
    // Without a current context the flag never clears.
    for (int i = 0; i < 16 && glGetError() != GL_NO_ERROR; ++i) {
    }
}

DebugGroup::DebugGroup(const std::string& label) {
    GLint depth = 0, most = 0;
    glGetIntegerv(GL_DEBUG_GROUP_STACK_DEPTH, &depth);
    glGetIntegerv(GL_MAX_DEBUG_GROUP_STACK_DEPTH, &most);
    pushed_ = depth < most;
    if (pushed_)
        glPushDebugGroup(GL_DEBUG_SOURCE_APPLICATION, 0, GLsizei(label.size()), label.data());
}

DebugGroup::~DebugGroup() {
    if (pushed_) glPopDebugGroup();
}

void label(unsigned kind, unsigned name, const std::string& label) {
    constexpr size_t kMaxLength = 255;  // of every device; a longer one is a GL error
    glObjectLabel(kind, name, GLsizei(std::min(label.size(), kMaxLength)), label.data());
}

}  // namespace postchain::gl
