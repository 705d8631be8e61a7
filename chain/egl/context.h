// An OpenGL 4.5 core context without a window, by EGL. On Windows by WGL, with a window that is
// never shown, on the device that the system chooses.
//
// By EGL: a device of EGL_EXT_platform_device if there is a GPU (a device that is not
// EGL_MESA_device_software: llvmpipe is listed there too), otherwise Mesa's surfaceless platform
// (llvmpipe) with a warning. No display server is needed. Use: one thread, make_current() once.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "chain/base/status.h"
#include "chain/gl/device.h"

namespace postchain::egl {

struct DeviceInfo {
    int index = 0;     // for --device: the place in list_devices()
    std::string name;  // EGL's words: extensions' driver name or device file
    bool software = false;

    std::string text() const;  // "EGL device 0 (/dev/dri/card0)"
};

// All EGL devices of this machine, in EGL's order. Never fails; empty without EGL, as on Windows.
std::vector<DeviceInfo> list_devices();

struct ContextOptions {
    // kAutomatic: the first GPU, otherwise software with a warning. kSoftware: software. kGpu: the
    // first GPU, otherwise an error. n >= 0: EGL device n.
    static constexpr int kAutomatic = -1;
    static constexpr int kSoftware = -2;
    static constexpr int kGpu = -3;
    int device = kAutomatic;
    bool debug = false;    // KHR_debug messages go to `log`
    gl::LogCallback log;   // messages of the library other than errors; may be empty
    gl::LogCallback warn;  // kAutomatic found no GPU; may be empty
};

class Context {
  public:
    // Makes a context and makes it current on this thread. StatusCode::gl with a list of the
    // attempts.
    static Result<std::unique_ptr<Context>> create(const ContextOptions& options = {});
    ~Context();
    Context(const Context&) = delete;
    Context& operator=(const Context&) = delete;

    Status make_current();
    void release_current();

    // For Executor and other code that uses the context.
    const gl::Device& device() const { return device_; }

  private:
    Context() = default;
    static Result<std::unique_ptr<Context>> open(void* device, const ContextOptions& options);
    void* display_ = nullptr;  // EGL's, or the device context of WGL's window
    void* context_ = nullptr;
    gl::Device device_;
};

}  // namespace postchain::egl
