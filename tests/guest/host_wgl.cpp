// The host's context: WGL, with a window that is never shown.
#include <windows.h>

#include <GL/glcorearb.h>
#include <GL/wglext.h>

#include <cstdio>
#include <cstdlib>

#include "tests/guest/host.h"

namespace postchain::test {
namespace {

struct Host {
    HWND window = nullptr;
    HDC display = nullptr;
    HGLRC context = nullptr;
};
Host host, other;

void must_hold(bool holds, const char* call) {
    if (holds) return;
    std::fprintf(stderr, "%s failed: error %lu\n", call, GetLastError());
    std::exit(1);
}

Host make(int profile = WGL_CONTEXT_CORE_PROFILE_BIT_ARB) {
    Host made;
    made.window =
        CreateWindowA("STATIC", "host", WS_POPUP, 0, 0, 64, 64, nullptr, nullptr, nullptr, nullptr);
    must_hold(made.window, "CreateWindow()");
    made.display = GetDC(made.window);
    PIXELFORMATDESCRIPTOR format = {};
    format.nSize = sizeof(format);
    format.nVersion = 1;
    format.dwFlags = PFD_DRAW_TO_WINDOW | PFD_SUPPORT_OPENGL | PFD_DOUBLEBUFFER;
    format.cColorBits = 24;
    must_hold(SetPixelFormat(made.display, ChoosePixelFormat(made.display, &format), &format),
              "SetPixelFormat()");
    const HGLRC first = wglCreateContext(made.display);
    must_hold(wglMakeCurrent(made.display, first), "wglMakeCurrent()");
    const auto create = reinterpret_cast<PFNWGLCREATECONTEXTATTRIBSARBPROC>(
        reinterpret_cast<void*>(wglGetProcAddress("wglCreateContextAttribsARB")));
    must_hold(create, "wglGetProcAddress()");
    const int attributes[] = {WGL_CONTEXT_MAJOR_VERSION_ARB,
                              4,
                              WGL_CONTEXT_MINOR_VERSION_ARB,
                              5,
                              WGL_CONTEXT_PROFILE_MASK_ARB,
                              profile,
                              0};
    made.context = create(made.display, nullptr, attributes);
    must_hold(made.context, "wglCreateContextAttribsARB()");
    must_hold(wglMakeCurrent(made.display, made.context), "wglMakeCurrent()");
    wglDeleteContext(first);
    return made;
}

}  // namespace

void make_host_context() {
    if (!host.context) host = make();
}
void release_host_context() {
    wglMakeCurrent(nullptr, nullptr);
}
void regain_host_context() {
    wglMakeCurrent(host.display, host.context);
}
void other_context() {
    other = make();
}
void other_context_of_compatibility() {
    other = make(WGL_CONTEXT_COMPATIBILITY_PROFILE_BIT_ARB);
}
void other_context_done() {
    regain_host_context();
    wglDeleteContext(other.context);
    ReleaseDC(other.window, other.display);
    DestroyWindow(other.window);
}

}  // namespace postchain::test
