#include "tools/sequence/run/device.h"

#include <sys/statvfs.h>

#include <algorithm>
#include <charconv>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <thread>
#include <utility>

#include "tools/sequence/exr/exr_reader.h"

namespace postchain::sequence {
namespace {

namespace fs = std::filesystem;

constexpr uint64_t kMinRoom = 16 << 20;  // bytes, for the index and a few programs

// The folder that has Mesa's cache of compiled programs, or is to have it.
fs::path folder_of_cache() {
    for (const auto& [name, below] :
         {std::pair("MESA_SHADER_CACHE_DIR", ""), {"XDG_CACHE_HOME", ""}, {"HOME", ".cache"}})
        if (const char* folder = std::getenv(name); folder && *folder != 0)
            return *below != 0 ? fs::path(folder) / below : fs::path(folder);
    return {};
}

// Mesa maps the index of its cache into memory: on a full disk SIGBUS would end the process.
void use_no_full_cache(const gl::LogCallback& warn) {
    fs::path folder = folder_of_cache();
    struct statvfs room;
    while (::statvfs(folder.c_str(), &room) != 0) {
        if (!folder.has_relative_path()) return;
        folder = folder.parent_path();
    }
    if (uint64_t(room.f_bavail) * uint64_t(room.f_frsize) >= kMinRoom) return;
    setenv("MESA_SHADER_CACHE_DISABLE", "true", 1);
    if (warn)
        warn(concat(folder.string(),
                    ": the disk is full: compiled programs are not kept there; "
                    "free some space"));
}

}  // namespace

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
                          "{device}: '"_keyed + device +
                              "' is not valid; give auto, gpu, software or a number "
                              "listed by `postchain info`");
    }
    // llvmpipe reads its thread count from this variable when the context is created.
    if (threads > 0) setenv("LP_NUM_THREADS", std::to_string(threads).c_str(), 1);
    io::set_exr_threads(threads_of(threads));
    use_no_full_cache(warn);
    return context;
}

std::string renderer_text(const gl::Device& device) {
    return device.renderer + ", " + device.version;
}

}  // namespace postchain::sequence
