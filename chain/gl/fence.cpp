#include "chain/gl/fence.h"

#include <epoxy/gl.h>

namespace postchain::gl {

Fence Fence::here() {
    Fence fence;
    fence.sync_ = glFenceSync(GL_SYNC_GPU_COMMANDS_COMPLETE, 0);
    return fence;
}

Fence::~Fence() {
    if (sync_) glDeleteSync(GLsync(sync_));
}

bool Fence::passed() {
    if (!sync_) return true;
    if (glClientWaitSync(GLsync(sync_), GL_SYNC_FLUSH_COMMANDS_BIT, 0) == GL_TIMEOUT_EXPIRED)
        return false;
    glDeleteSync(GLsync(sync_));
    sync_ = nullptr;
    return true;
}

void Fence::wait(const Meanwhile& meanwhile) {
    while (!passed()) {
        if (meanwhile && meanwhile()) continue;
        glClientWaitSync(GLsync(sync_), GL_SYNC_FLUSH_COMMANDS_BIT, GL_TIMEOUT_IGNORED);
        glDeleteSync(GLsync(sync_));
        sync_ = nullptr;
    }
}

}  // namespace postchain::gl
