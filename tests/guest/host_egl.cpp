// The host's context: EGL without a window.
#include <epoxy/egl.h>

#include <cstdio>
#include <cstdlib>

#include "chain/egl/context.h"
#include "tests/guest/host.h"

namespace postchain::test {
namespace {

std::unique_ptr<egl::Context>& host_context() {
    static std::unique_ptr<egl::Context> context;
    return context;
}
std::unique_ptr<egl::Context> other;
EGLDisplay compatibility_display = EGL_NO_DISPLAY;
EGLContext compatibility = EGL_NO_CONTEXT;

std::unique_ptr<egl::Context> make() {
    auto made = egl::Context::create();
    if (!made.ok()) {
        std::fprintf(stderr, "%s\n", made.status().message().c_str());
        std::exit(1);
    }
    return std::move(*made);
}

}  // namespace

void make_host_context() {
    if (!host_context()) host_context() = make();
}
void release_host_context() {
    host_context()->release_current();
}
void regain_host_context() {
    (void)host_context()->make_current();
}
void other_context() {
    other = make();
}
void other_context_of_compatibility() {
    compatibility_display =
        eglGetPlatformDisplayEXT(EGL_PLATFORM_SURFACELESS_MESA, EGL_DEFAULT_DISPLAY, nullptr);
    const EGLint attributes[] = {EGL_CONTEXT_MAJOR_VERSION,
                                 4,
                                 EGL_CONTEXT_MINOR_VERSION,
                                 5,
                                 EGL_CONTEXT_OPENGL_PROFILE_MASK,
                                 EGL_CONTEXT_OPENGL_COMPATIBILITY_PROFILE_BIT,
                                 EGL_NONE};
    if (eglInitialize(compatibility_display, nullptr, nullptr) && eglBindAPI(EGL_OPENGL_API))
        compatibility =
            eglCreateContext(compatibility_display, EGL_NO_CONFIG_KHR, EGL_NO_CONTEXT, attributes);
    if (compatibility == EGL_NO_CONTEXT ||
        !eglMakeCurrent(compatibility_display, EGL_NO_SURFACE, EGL_NO_SURFACE, compatibility)) {
        std::fprintf(stderr, "no EGL context of the compatibility profile\n");
        std::exit(1);
    }
}
void other_context_done() {
    other.reset();
    if (compatibility != EGL_NO_CONTEXT) {
        eglMakeCurrent(compatibility_display, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
        eglDestroyContext(compatibility_display, compatibility);
        compatibility = EGL_NO_CONTEXT;
    }
    regain_host_context();
}

}  // namespace postchain::test
