// By EGL and GLX.
#include "chain/guest/current_context.h"

#include <dlfcn.h>

#include "chain/base/status.h"

namespace postchain::guest {
namespace {

// Null unless the library is loaded. The code that made the context has loaded it.
void* loaded_function(const char* library, const char* name) {
    void* handle = dlopen(library, RTLD_LAZY | RTLD_NOLOAD);
    if (!handle) return nullptr;
    void* function = dlsym(handle, name);
    dlclose(handle);  // only decrements the count; the library stays loaded
    return function;
}

}  // namespace

ContextId ContextId::current() {
    static constexpr const char* kCalls[][2] = {{"libEGL.so.1", "eglGetCurrentContext"},
                                                {"libGLX.so.0", "glXGetCurrentContext"},
                                                {"libGL.so.1", "glXGetCurrentContext"}};
    for (const auto& [library, name] : kCalls) {
        const auto ask = reinterpret_cast<Ask>(loaded_function(library, name));
        if (!ask) continue;
        ContextId id;
        id.ask_ = ask;
        id.context_ = ask();
        if (id) return id;
    }
    return {};
}

Failure check_epoxy() {
    // The libraries that it tries, in its order.
    for (const char* library : {"libGLX.so.1", "libGL.so.1"}) {
        void* handle = dlopen(library, RTLD_LAZY);
        if (!handle) continue;
        const bool complete = dlsym(handle, "glXGetCurrentContext") != nullptr;
        dlclose(handle);
        if (complete) return {};
        return {PC_ERROR_CONTEXT,
                concat(library,
                       " has no glXGetCurrentContext, which libepoxy needs under EGL too; "
                       "a tracer of EGL alone replaces it: use apitrace trace --api=gl")};
    }
    return {PC_ERROR_CONTEXT,
            "libGL.so.1 is missing, which libepoxy needs; install libglvnd, or the GL library of "
            "the driver"};
}

}  // namespace postchain::guest
