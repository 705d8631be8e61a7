// An OpenGL 4.5 core context without a window, by EGL.
//
// A device of EGL_EXT_platform_device when there is a GPU (a device that is not
// EGL_MESA_device_software: llvmpipe is listed there too), Mesa's surfaceless platform (llvmpipe)
// otherwise. No display server is needed. Use: one thread, make_current() once.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "chain/status.h"

namespace postchain::gl {

struct DeviceInfo {
    int index = 0;     // for --device: the place in list_devices()
    std::string name;  // EGL's words: extensions' driver name or device file
    bool software = false;
};

// All EGL devices of this machine, in EGL's order. Never fails; empty without EGL.
std::vector<DeviceInfo> list_devices();

// Takes one message, without a newline at its end.
using LogCallback = std::function<void(const std::string&)>;

struct ContextOptions {
    // -1: the first GPU, else software. kSoftware: software. n >= 0: EGL device n.
    static constexpr int kAutomatic = -1;
    static constexpr int kSoftware = -2;
    int device = kAutomatic;
    bool debug = false;  // KHR_debug messages go to `log`
    LogCallback log;     // what the library has to say besides errors; may be empty
};

// What the device allows, as GL states it.
struct Limits {
    int texture_px = 0;               // a side of a texture
    int64_t storage_block_bytes = 0;  // a work list
    int shared_memory_bytes = 0;      // of a work group
    int group_invocations = 0;        // threads of a work group
    int groups = 0;                   // work groups a side of a dispatch, the least of x and y
    int texture_units = 0;            // in a compute shader
    int image_units = 0;
};

class Context {
  public:
    // Makes a context and makes it current on this thread. StatusCode::gl with what was tried.
    static Result<std::unique_ptr<Context>> create(const ContextOptions& options = {});
    ~Context();
    Context(const Context&) = delete;
    Context& operator=(const Context&) = delete;

    Status make_current();
    void release_current();

    const std::string& vendor() const { return vendor_; }
    const std::string& renderer() const { return renderer_; }
    const std::string& version() const { return version_; }
    // llvmpipe, softpipe, swrast: GL timers are wrong there by orders of magnitude.
    bool software() const { return software_; }
    const Limits& limits() const { return limits_; }
    const LogCallback& log() const { return log_; }

  private:
    Context() = default;
    void* display_ = nullptr;
    void* context_ = nullptr;
    std::string vendor_, renderer_, version_;
    bool software_ = false;
    Limits limits_;
    LogCallback log_;
};

// The GL error flag as a Status: out of memory is named as such.
Status check_error(const std::string& doing);

// Groups the GL calls of a scope in debuggers (KHR_debug).
class DebugGroup {
  public:
    explicit DebugGroup(const std::string& label);
    ~DebugGroup();
    DebugGroup(const DebugGroup&) = delete;
    DebugGroup& operator=(const DebugGroup&) = delete;
};
// `kind` is GL_TEXTURE or GL_BUFFER.
void label(unsigned kind, unsigned name, const std::string& label);
void label_program(unsigned program, const std::string& label);

}  // namespace postchain::gl
