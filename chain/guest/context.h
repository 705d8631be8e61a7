// Finds the GL context that is current on this thread, whoever made it, without loading a library.
#pragma once

#include "chain/guest/failure.h"

namespace postchain::guest {

// A context, and the call that returned it. Null if there is none.
class ContextId {
  public:
    ContextId() = default;
    // The context that is current now, found by EGL or GLX.
    static ContextId current();
    explicit operator bool() const { return context_ != nullptr; }
    bool is_current() const { return ask_ && ask_() == context_; }

  private:
    using Ask = void* (*)();
    Ask ask_ = nullptr;
    void* context_ = nullptr;
};

// libepoxy ends the process if the GLX library that it finds has no glXGetCurrentContext(), as
// under `apitrace trace --api=egl`: then PC_ERROR_CONTEXT. Calls no GL.
Failure check_epoxy();

// PC_ERROR_CONTEXT if the current context is not desktop OpenGL 4.5 or later; the text names it.
Failure check_version();

}  // namespace postchain::guest
