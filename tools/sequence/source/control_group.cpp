#include "tools/sequence/source/control_group.h"

#include <algorithm>
#include <fstream>

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

}  // namespace postchain::sequence
