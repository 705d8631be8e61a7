#include "tools/sequence/run/device.h"

#include <algorithm>
#include <charconv>
#include <cstdlib>
#include <memory>
#include <thread>
#include <utility>

#include "tools/sequence/exr/exr_reader.h"

namespace postchain::sequence {

int threads_of(int threads) {
    return threads > 0 ? threads : std::max(1, int(std::thread::hardware_concurrency()));
}

Result<egl::ContextOptions> choose_device(const std::string& device, int threads,
                                          gl::LogCallback warn) {
    egl::ContextOptions context;
    if (warn)
        context.warn = [warn, said = std::make_shared<bool>(false)](const std::string& text) {
            if (!std::exchange(*said, true)) warn(text);
        };
    if (device == "software") {
        context.device = egl::ContextOptions::kSoftware;
    } else if (device == "gpu") {
        context.device = egl::ContextOptions::kGpu;
    } else if (device != "auto") {
        const char* end = device.data() + device.size();
        const auto parsed = std::from_chars(device.data(), end, context.device);
        if (parsed.ec != std::errc() || parsed.ptr != end || context.device < 0)
            return Status(StatusCode::usage,
                          "--device: '" + device +
                              "' is not valid; give auto, gpu, software or a number "
                              "listed by `postchain info`");
    }
    // llvmpipe reads its thread count from this variable when the context is created.
    if (threads > 0) setenv("LP_NUM_THREADS", std::to_string(threads).c_str(), 1);
    io::set_exr_threads(threads_of(threads));
    return context;
}

std::string renderer_text(const gl::Device& device) {
    return device.renderer + ", " + device.version;
}

}  // namespace postchain::sequence
