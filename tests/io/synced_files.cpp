#include "tests/io/synced_files.h"

#include <stdio.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <cerrno>
#include <filesystem>

namespace postchain::test {

SyncedFiles& synced_files() {
    static thread_local SyncedFiles files;
    return files;
}

}  // namespace postchain::test

namespace {

std::string path_of(int fd) {
    std::error_code ignored;
    return std::filesystem::read_symlink("/proc/self/fd/" + std::to_string(fd), ignored).string();
}

}  // namespace

// In place of the C library's for everything that is linked into this program.
extern "C" int fsync(int fd) {
    auto& files = postchain::test::synced_files();
    struct stat info;
    if (::fstat(fd, &info) != 0) return -1;
    files.paths.push_back(path_of(fd));
    errno = S_ISDIR(info.st_mode) ? files.folder_error : files.error;
    return errno == 0 ? 0 : -1;
}

extern "C" int renameat2(int from_folder, const char* from, int to_folder, const char* to,
                         unsigned flags) noexcept {
    errno = postchain::test::synced_files().rename_error;
    if (errno != 0) return -1;
    return int(::syscall(SYS_renameat2, from_folder, from, to_folder, to, flags));
}

extern "C" int flock(int fd, int operation) {
    if (const auto& before = postchain::test::synced_files().before_lock) before(path_of(fd));
    errno = postchain::test::synced_files().lock_error;
    return errno == 0 ? int(::syscall(SYS_flock, fd, operation)) : -1;
}
