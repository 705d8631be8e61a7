// By EGL.
#include "chain/egl/context.h"

#include <dlfcn.h>
#include <epoxy/egl.h>

#include <cstring>

#include "chain/egl/setup.h"

namespace postchain::egl {
namespace {

constexpr int kSurfaceless = -1;

bool has_word(const char* words, const char* word) {
    if (!words) return false;
    const size_t length = std::strlen(word);
    for (const char* at = words; (at = std::strstr(at, word)); at += length) {
        const bool starts = at == words || at[-1] == ' ';
        if (starts && (at[length] == ' ' || at[length] == 0)) return true;
    }
    return false;
}

std::vector<EGLDeviceEXT> devices() {
    if (!epoxy_has_egl_extension(EGL_NO_DISPLAY, "EGL_EXT_device_enumeration") &&
        !epoxy_has_egl_extension(EGL_NO_DISPLAY, "EGL_EXT_device_base"))
        return {};
    EGLint count = 0;
    if (!eglQueryDevicesEXT(0, nullptr, &count) || count <= 0) return {};
    std::vector<EGLDeviceEXT> found(static_cast<size_t>(count));
    if (!eglQueryDevicesEXT(count, found.data(), &count)) return {};
    found.resize(static_cast<size_t>(count));
    return found;
}

DeviceInfo describe(EGLDeviceEXT device, int index) {
    DeviceInfo info;
    info.index = index;
    const char* extensions = eglQueryDeviceStringEXT(device, EGL_EXTENSIONS);
    info.software = has_word(extensions, "EGL_MESA_device_software");
    const char* name = nullptr;
    if (has_word(extensions, "EGL_EXT_device_drm"))
        name = eglQueryDeviceStringEXT(device, EGL_DRM_DEVICE_FILE_EXT);
    info.name = name ? name : (info.software ? "software rasterizer" : "device");
    return info;
}

// The display of an EGL device, or of Mesa's surfaceless platform for nullptr.
EGLDisplay open_display(EGLDeviceEXT device) {
    if (device) return eglGetPlatformDisplayEXT(EGL_PLATFORM_DEVICE_EXT, device, nullptr);
    if (!epoxy_has_egl_extension(EGL_NO_DISPLAY, "EGL_MESA_platform_surfaceless"))
        return EGL_NO_DISPLAY;
    return eglGetPlatformDisplayEXT(EGL_PLATFORM_SURFACELESS_MESA, EGL_DEFAULT_DISPLAY, nullptr);
}

Result<EGLContext> open_context(EGLDisplay display, bool debug) {
    EGLint major = 0, minor = 0;
    if (display == EGL_NO_DISPLAY || !eglInitialize(display, &major, &minor))
        return Status(StatusCode::gl, "EGL display cannot be initialized");
    if (!eglBindAPI(EGL_OPENGL_API)) return Status(StatusCode::gl, "EGL offers no OpenGL API");
    const EGLint attributes[] = {EGL_CONTEXT_MAJOR_VERSION,
                                 4,
                                 EGL_CONTEXT_MINOR_VERSION,
                                 5,
                                 EGL_CONTEXT_OPENGL_PROFILE_MASK,
                                 EGL_CONTEXT_OPENGL_CORE_PROFILE_BIT,
                                 EGL_CONTEXT_OPENGL_DEBUG,
                                 debug ? EGL_TRUE : EGL_FALSE,
                                 EGL_NONE};
    EGLContext context = eglCreateContext(display, EGL_NO_CONFIG_KHR, EGL_NO_CONTEXT, attributes);
    if (context == EGL_NO_CONTEXT)
        return Status(StatusCode::gl, concat("no OpenGL 4.5 core context (EGL error 0x", std::hex,
                                             eglGetError(), ")"));
    return context;
}

// libepoxy loads them at its first call, and ends the process if it cannot. They stay loaded.
Status check_libraries() {
    const auto loads = [](const char* library) { return dlopen(library, RTLD_LAZY) != nullptr; };
    const char* missing = !loads("libEGL.so.1")                              ? "libEGL.so.1"
                          : !loads("libOpenGL.so.0") && !loads("libGL.so.1") ? "libOpenGL.so.0"
                                                                             : nullptr;
    if (!missing) return Status();
    return Status(StatusCode::gl, concat(missing,
                                         " cannot be loaded; install libglvnd (its "
                                         "libraries EGL and OpenGL) and a GL driver"));
}

}  // namespace

std::string DeviceInfo::text() const {
    return concat("EGL device ", index, " (", name, ")");
}

std::vector<DeviceInfo> list_devices() {
    std::vector<DeviceInfo> infos;
    if (!check_libraries().ok()) return infos;
    const auto found = devices();
    for (size_t i = 0; i < found.size(); ++i) infos.push_back(describe(found[i], int(i)));
    return infos;
}

// On `device`, or surfaceless for nullptr.
Result<std::unique_ptr<Context>> Context::open(void* device, const ContextOptions& options) {
    EGLDisplay display = open_display(device);
    ASSIGN_OR_RETURN(auto context, open_context(display, options.debug));
    std::unique_ptr<Context> made(new Context);
    made->display_ = display;
    made->context_ = context;
    RETURN_IF_ERROR(made->make_current());
    made->device_ = gl::describe_current(options.log);
    set_up_current(made->device_, options.debug);
    return made;
}

Result<std::unique_ptr<Context>> Context::create(const ContextOptions& options) {
    const bool automatic = options.device == ContextOptions::kAutomatic;
    const bool wants_gpu = automatic || options.device == ContextOptions::kGpu;
    RETURN_IF_ERROR(check_libraries());
    const auto found = devices();
    std::vector<int> candidates;  // kSurfaceless, or a place in `found`
    if (options.device >= 0) {
        if (size_t(options.device) >= found.size())
            return Status(StatusCode::gl,
                          concat("device ", options.device, " does not exist; this machine has ",
                                 found.size(), " (see `postchain info`)"));
        candidates = {options.device};
    } else {
        // Surfaceless may be the GPU if that has a Mesa driver: for software rendering the software
        // device is used if there is one.
        for (size_t i = 0; i < found.size(); ++i)
            if (describe(found[i], int(i)).software != wants_gpu) candidates.push_back(int(i));
        candidates.push_back(kSurfaceless);
    }

    std::string tried;
    std::unique_ptr<Context> software;  // instead of a GPU
    for (const int candidate : candidates) {
        const std::string name = candidate == kSurfaceless
                                     ? "surfaceless"
                                     : describe(found[size_t(candidate)], candidate).text();
        auto made = open(candidate == kSurfaceless ? nullptr : found[size_t(candidate)], options);
        if (made.ok() && !(wants_gpu && (*made)->device().software)) return made;
        tried += concat(tried.empty() ? "" : "; ", name, ": ",
                        made.ok() ? "a software renderer, " + (*made)->device().renderer
                                  : made.status().message());
        if (made.ok() && automatic && !software) software = std::move(*made);
    }
    if (software) {
        RETURN_IF_ERROR(software->make_current());
        if (options.warn)
            options.warn(concat("no GPU with OpenGL 4.5 was found (", tried,
                                "): computing on the CPU; install the GPU's driver, or give "
                                "{device=software} if the CPU is meant"_keyed));
        return software;
    }
    if (options.device == ContextOptions::kGpu)
        return Status(StatusCode::gl,
                      concat("no GPU with OpenGL 4.5 was found (", tried,
                             "); install its driver, or give "
                             "{device=auto or software} to compute on the CPU"_keyed));
    return Status(StatusCode::gl,
                  "no usable OpenGL 4.5: " + tried + "; install a driver with EGL, such as Mesa's");
}

Context::~Context() {
    if (!context_) return;
    release_current();
    eglDestroyContext(display_, context_);
}

Status Context::make_current() {
    if (eglMakeCurrent(display_, EGL_NO_SURFACE, EGL_NO_SURFACE, context_)) return Status();
    return Status(StatusCode::gl, "the GL context cannot be made current on this thread");
}

void Context::release_current() {
    if (eglGetCurrentContext() == context_)
        eglMakeCurrent(display_, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
}

}  // namespace postchain::egl
