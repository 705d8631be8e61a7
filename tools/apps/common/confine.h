// A process that opens only its files, and has no network: what a damaged file or a changed link
// does to it reaches nothing else.
#pragma once

#include <string>
#include <vector>

#include "chain/base/status.h"

namespace postchain {

// Files that a confined process may use beside those of the system, which it reads.
struct Confinement {
    std::vector<std::string> reads;    // files, and folders with everything below
    std::vector<std::string> writes;   // folders: files are also made, replaced and removed
    std::vector<std::string> devices;  // read and written
};

// From now on, for this thread and the threads and processes that it starts: everything else that
// this kernel's Landlock controls fails, other processes get no signal, no program gains rights,
// and there are no sockets but AF_UNIX. Errors (internal): the kernel refuses.
Status confine(const Confinement& to);

// For the whole process, before it has other threads or a device: reads and writes in the folders,
// reads the files too, uses devices, and keeps compiled programs in a folder of its own. What this
// program opens itself is confined without Landlock too (chain/base/readable_file.h). Errors:
// (usage) a folder does not exist; those of confine().
Status confine_to(const std::vector<std::string>& folders, const std::vector<std::string>& files);

// What confine_to() cannot do with this kernel; empty = nothing.
std::string confinement();

// The version of Landlock in this kernel; 0 = none.
int landlock_version();
// Devices in /dev, without the memory that programs share there.
std::vector<std::string> devices_of_system();

}  // namespace postchain
