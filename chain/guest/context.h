// Which GL context is current on this thread, whoever made it, without making any library load.
#pragma once

#include <string>

#include "chain/guest/failure.h"

namespace postchain::guest {

// A context and the call that finds it again. Nothing: null.
class ContextId {
  public:
    ContextId() = default;
    // Of the context that is current now, by EGL or GLX.
    static ContextId current();
    explicit operator bool() const { return context_ != nullptr; }
    bool is_current() const { return ask_ && ask_() == context_; }

  private:
    using Ask = void* (*)();
    Ask ask_ = nullptr;
    void* context_ = nullptr;
};

// Is the current context desktop OpenGL 4.5 or later? Else PC_ERROR_CONTEXT, which says what it is.
Failure check_version();

}  // namespace postchain::guest
