// By WGL.
#include "chain/egl/context.h"

#include <windows.h>

#include "chain/egl/setup.h"

namespace postchain::egl {
namespace {

// WGL_ARB_create_context
using CreateContext = HGLRC(WINAPI*)(HDC, HGLRC, const int*);
constexpr int kMajorVersion = 0x2091, kMinorVersion = 0x2092, kFlags = 0x2094, kProfile = 0x9126;
constexpr int kCoreProfile = 1, kDebugFlag = 1;

constexpr const char* kWindowClass = "postchain_context";

Status failed(const char* call) {
    return Status(StatusCode::gl, concat(call, " failed (error ", GetLastError(), ")"));
}

// The device context of a new window, which is never shown.
Result<HDC> open_window() {
    WNDCLASSA window_class = {};
    window_class.style = CS_OWNDC;
    window_class.lpfnWndProc = DefWindowProcA;
    window_class.hInstance = GetModuleHandleA(nullptr);
    window_class.lpszClassName = kWindowClass;
    if (!RegisterClassA(&window_class) && GetLastError() != ERROR_CLASS_ALREADY_EXISTS)
        return failed("RegisterClass()");
    const HWND window =
        CreateWindowExA(0, kWindowClass, "", WS_POPUP | WS_CLIPCHILDREN | WS_CLIPSIBLINGS, 0, 0, 1,
                        1, nullptr, nullptr, window_class.hInstance, nullptr);
    if (!window) return failed("CreateWindow()");
    return GetDC(window);
}

void close_window(HDC display) {
    const HWND window = WindowFromDC(display);
    ReleaseDC(window, display);
    DestroyWindow(window);
}

Status set_pixel_format(HDC display) {
    PIXELFORMATDESCRIPTOR format = {};
    format.nSize = sizeof(format);
    format.nVersion = 1;
    format.dwFlags = PFD_DRAW_TO_WINDOW | PFD_SUPPORT_OPENGL | PFD_DOUBLEBUFFER;
    format.iPixelType = PFD_TYPE_RGBA;
    format.cColorBits = 24;
    const int chosen = ChoosePixelFormat(display, &format);
    if (!chosen || !SetPixelFormat(display, chosen, &format)) return failed("SetPixelFormat()");
    return Status();
}

// The call that makes a context of a version is found by a context of any version.
CreateContext find_create_context(HDC display) {
    const HGLRC any = wglCreateContext(display);
    if (!any) return nullptr;
    const HDC display_before = wglGetCurrentDC();
    const HGLRC before = wglGetCurrentContext();
    CreateContext found = nullptr;
    if (wglMakeCurrent(display, any))
        found = reinterpret_cast<CreateContext>(
            reinterpret_cast<void*>(wglGetProcAddress("wglCreateContextAttribsARB")));
    wglMakeCurrent(display_before, before);
    wglDeleteContext(any);
    return found;
}

Result<HGLRC> open_context(HDC display, bool debug) {
    RETURN_IF_ERROR(set_pixel_format(display));
    const CreateContext create = find_create_context(display);
    if (!create)
        return Status(StatusCode::gl,
                      "WGL has no wglCreateContextAttribsARB(): no driver for OpenGL is installed");
    const int attributes[] = {kMajorVersion, 4,      kMinorVersion,          5, kProfile,
                              kCoreProfile,  kFlags, debug ? kDebugFlag : 0, 0};
    const HGLRC context = create(display, nullptr, attributes);
    if (!context)
        return Status(StatusCode::gl,
                      concat("no OpenGL 4.5 core context (error ", GetLastError(), ")"));
    return context;
}

}  // namespace

std::string DeviceInfo::text() const {
    return concat("device ", index, " (", name, ")");
}

std::vector<DeviceInfo> list_devices() {
    return {};
}

Result<std::unique_ptr<Context>> Context::open(void*, const ContextOptions& options) {
    std::unique_ptr<Context> made(new Context);
    ASSIGN_OR_RETURN(const HDC display, open_window());
    made->display_ = display;
    ASSIGN_OR_RETURN(const HGLRC context, open_context(display, options.debug));
    made->context_ = context;
    RETURN_IF_ERROR(made->make_current());
    made->device_ = gl::describe_current(options.log);
    set_up_current(made->device_, options.debug);
    return made;
}

Result<std::unique_ptr<Context>> Context::create(const ContextOptions& options) {
    if (options.device >= 0)
        return Status(StatusCode::gl,
                      concat("device ", options.device, ": WGL has the system's device alone"));
    ASSIGN_OR_RETURN(auto made, open(nullptr, options));
    const gl::Device& device = made->device();
    const bool wants_gpu = options.device == ContextOptions::kGpu;
    if (device.software ? wants_gpu : options.device == ContextOptions::kSoftware)
        return Status(StatusCode::gl, concat("the system's device is ", device.renderer, ", not ",
                                             wants_gpu ? "a GPU" : "a software renderer"));
    if (device.software && options.device == ContextOptions::kAutomatic && options.warn)
        options.warn(
            concat("no GPU with OpenGL 4.5 was found: computing on the CPU by ", device.renderer));
    return made;
}

Context::~Context() {
    if (context_) {
        release_current();
        wglDeleteContext(static_cast<HGLRC>(context_));
    }
    if (display_) close_window(static_cast<HDC>(display_));
}

Status Context::make_current() {
    if (wglMakeCurrent(static_cast<HDC>(display_), static_cast<HGLRC>(context_))) return Status();
    return Status(StatusCode::gl, "the GL context cannot be made current on this thread");
}

void Context::release_current() {
    if (wglGetCurrentContext() == context_) wglMakeCurrent(nullptr, nullptr);
}

}  // namespace postchain::egl
