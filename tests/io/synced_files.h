// The files and folders that the tested code has synced to disk, and what happens before it locks
// one.
#pragma once

#include <functional>
#include <string>
#include <vector>

namespace postchain::test {

// fsync() of this program does not wait for the disk: it notes the path, or fails with `error`.
struct SyncedFiles {
    std::vector<std::string> paths;
    int error = 0;                                                  // of files, if not 0
    int folder_error = 0;                                           // of folders
    int lock_error = 0;                                             // of flock(), if not 0
    int rename_error = 0;                                           // of renameat2()
    std::function<void(const std::string& path)> before_lock = {};  // called by flock()
};
SyncedFiles& synced_files();

}  // namespace postchain::test
