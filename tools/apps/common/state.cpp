#include "tools/apps/common/state.h"

#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <fstream>

namespace postchain {

namespace fs = std::filesystem;

std::string state_folder() {
    const char* state = std::getenv("XDG_STATE_HOME");
    if (state && *state) return std::string(state) + "/postchain";
    const char* home = std::getenv("HOME");
    return home && *home ? std::string(home) + "/.local/state/postchain" : "";
}

bool first_today(const std::string& name) {
    const std::string folder = state_folder();
    if (folder.empty()) return true;
    const fs::path stamp = fs::path(folder) / name;
    std::error_code error;
    const auto now = fs::file_time_type::clock::now();
    const auto last = fs::last_write_time(stamp, error);
    // A time that is still to come is that of a clock which was set back.
    if (!error && last <= now && now - last < std::chrono::hours(24)) return false;
    fs::create_directories(folder, error);
    std::ofstream file(stamp);
    fs::last_write_time(stamp, now, error);
    return true;
}

}  // namespace postchain
