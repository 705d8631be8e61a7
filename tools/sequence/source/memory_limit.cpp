#include "tools/sequence/source/memory_limit.h"

#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <fstream>
#include <iterator>

namespace postchain::sequence {
namespace {

// The limit in a control group file; 0 if there is none.
uint64_t stated_in(const std::string& path) {
    std::ifstream file(path);
    uint64_t bytes = 0;
    return file >> bytes ? bytes : 0;
}

}  // namespace

uint64_t memory_of_groups(const std::string& groups, const std::string& mounted) {
    uint64_t least = 0;
    std::ifstream file(groups);
    for (std::string line; std::getline(file, line);) {
        const size_t first = line.find(':'), second = line.find(':', first + 1);
        if (second == line.npos) continue;
        const std::string controllers = line.substr(first + 1, second - first - 1);
        const bool unified = controllers.empty();
        if (!unified && ("," + controllers + ",").find(",memory,") == line.npos) continue;
        const std::string folder = mounted + (unified ? "" : "/memory");
        const char* name = unified ? "/memory.max" : "/memory.limit_in_bytes";
        // A process is under the limits of all groups around its own. In a container, its path may
        // be the one outside, and only the root is mounted.
        for (std::string path = line.substr(second + 1);; path.erase(path.rfind('/'))) {
            if (path == "/") path.clear();
            if (const uint64_t stated = stated_in(folder + path + name))
                least = least == 0 ? stated : std::min(least, stated);
            if (path.find('/') == path.npos) break;
        }
    }
    return least;
}

uint64_t default_memory_limit() {
    uint64_t bytes = uint64_t(sysconf(_SC_PHYS_PAGES)) * uint64_t(sysconf(_SC_PAGESIZE));
    if (const uint64_t stated = memory_of_groups("/proc/self/cgroup", "/sys/fs/cgroup"))
        bytes = std::min(bytes, stated);
    return bytes / 4 * 3;
}

std::string bytes_text(uint64_t bytes) {
    const char* units[] = {"bytes", "KiB", "MiB", "GiB", "TiB"};
    double value = double(bytes);
    size_t unit = 0;
    while (value >= 1024 && unit + 1 < std::size(units)) value /= 1024, ++unit;
    char text[48];
    std::snprintf(text, sizeof(text), unit == 0 ? "%.0f %s" : "%.1f %s", value, units[unit]);
    return text;
}

}  // namespace postchain::sequence
