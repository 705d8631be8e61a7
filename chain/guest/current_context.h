// The GL context that is current on this thread, whoever made it.
#pragma once

#include "chain/guest/failure.h"

namespace postchain::guest {

// A context, and the call that returned it. Null if there is none.
class ContextId {
  public:
    ContextId() = default;
    // The context that is current now, found by EGL or GLX, on Windows by WGL.
    static ContextId current();
    explicit operator bool() const { return context_ != nullptr; }
    bool is_current() const { return ask_ && ask_() == context_; }

  private:
    using Ask = void* (*)();
    Ask ask_ = nullptr;
    void* context_ = nullptr;
};

// libepoxy ends the process if the GLX library that it finds has no glXGetCurrentContext(), as
// under `apitrace trace --api=egl`: then PC_ERROR_CONTEXT. Calls no GL. Windows has no such case.
Failure check_epoxy();

}  // namespace postchain::guest
