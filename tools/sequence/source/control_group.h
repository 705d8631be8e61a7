// Limits of the control groups (cgroups) of a process.
#pragma once

#include <cstdint>
#include <string>

namespace postchain::sequence {

// The least memory limit of the control groups of a process and of those around them, bytes; 0 =
// none. `groups`: /proc/self/cgroup; `mounted`: /sys/fs/cgroup. Versions 1 and 2.
uint64_t memory_of_groups(const std::string& groups, const std::string& mounted);

}  // namespace postchain::sequence
