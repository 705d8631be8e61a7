// By WGL.
#include "chain/guest/current_context.h"

#include <windows.h>

namespace postchain::guest {

ContextId ContextId::current() {
    ContextId id;
    id.ask_ = [] { return static_cast<void*>(wglGetCurrentContext()); };
    id.context_ = id.ask_();
    return id;
}

Failure check_epoxy() {
    return {};
}

}  // namespace postchain::guest
