#include "shaders/embedded.h"

#include <mutex>

namespace postchain {
namespace {

struct Added {
    std::mutex mutex;
    std::vector<EmbeddedFile> files;
};

Added& added() {
    static Added all;
    return all;
}

}  // namespace

bool add_shaders(const std::vector<EmbeddedFile>& files) {
    const std::lock_guard lock(added().mutex);
    added().files.insert(added().files.end(), files.begin(), files.end());
    return true;
}

std::optional<std::string_view> find_shader(std::string_view path) {
    for (const auto& file : embedded_shaders())
        if (file.path == path) return file.text;
    const std::lock_guard lock(added().mutex);
    for (const auto& file : added().files)
        if (file.path == path) return file.text;
    return std::nullopt;
}

}  // namespace postchain
