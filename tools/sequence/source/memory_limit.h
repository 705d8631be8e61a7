// The memory that a process may take: that of the machine, or of its control groups (cgroups).
#pragma once

#include <cstdint>
#include <string>

namespace postchain::sequence {

// The least memory limit of the control groups of a process and of those around them, bytes; 0 =
// none. `groups`: /proc/self/cgroup; `mounted`: /sys/fs/cgroup. Versions 1 and 2.
uint64_t memory_of_groups(const std::string& groups, const std::string& mounted);

// Three quarters of the memory of the machine or of the process's control group.
uint64_t default_memory_limit();

std::string bytes_text(uint64_t bytes);  // "6.2 GiB"

}  // namespace postchain::sequence
