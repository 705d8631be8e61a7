#include "chain/base/readable_file.h"

#include <fcntl.h>
#include <linux/openat2.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <climits>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <mutex>
#include <utility>

namespace postchain {
namespace {

// Without waiting for the writer of a pipe, and without becoming the terminal's process.
constexpr int kFlags = O_RDONLY | O_CLOEXEC | O_NONBLOCK | O_NOCTTY;
constexpr int kFolderFlags = O_PATH | O_DIRECTORY | O_CLOEXEC;
constexpr int kNotAFile = ESPIPE;
constexpr uint64_t kMaxOwnText = uint64_t(64) << 20;

struct Confined {
    std::vector<std::string> folders;   // none: not confined
    std::vector<std::string> readable;  // none: what is named outside of the folders
};
std::mutex g_mutex;
Confined g_confined;

Confined confined() {
    const std::lock_guard lock(g_mutex);
    return g_confined;
}

// The folder that has this path; empty = none.
std::string folder_of(const std::string& path, const std::vector<std::string>& folders) {
    for (const std::string& folder : folders)
        if (folder == "/" || path == folder || path.starts_with(folder + "/")) return folder;
    return "";
}

// As open_beneath(), for kernels and containers without openat2: one name after the other.
int open_by_names(int folder, const std::string& path, int flags) {
    int at = ::dup(folder);
    for (size_t begin = 0; at >= 0;) {
        const size_t end = std::min(path.find('/', begin), path.size());
        const std::string name = path.substr(begin, end - begin);
        const bool last = end == path.size();
        const int next = name == ".."
                             ? (errno = EXDEV, -1)
                             : ::openat(at, name.empty() ? "." : name.c_str(),
                                        last ? flags | O_NOFOLLOW : kFolderFlags | O_NOFOLLOW);
        const int error = errno;
        ::close(at);
        errno = error;
        if (last) return next;
        at = next;
        begin = end + 1;
    }
    return -1;
}

// A path below a folder, without following a link.
int open_beneath(const std::string& folder, const std::string& path, int flags) {
    const int at = ::open(folder.c_str(), kFolderFlags);
    if (at < 0) return -1;
    open_how how = {};
    how.flags = uint64_t(flags);
    how.resolve = RESOLVE_BENEATH | RESOLVE_NO_SYMLINKS | RESOLVE_NO_MAGICLINKS;
    int fd = int(::syscall(SYS_openat2, at, path.c_str(), &how, sizeof(how)));
    if (fd < 0 && (errno == ENOSYS || errno == EPERM)) fd = open_by_names(at, path, flags);
    const int error = errno;
    ::close(at);
    errno = error;
    return fd;
}

// The rest of a path below a folder that has it.
std::string below(const std::string& path, const std::string& folder) {
    const size_t begin = folder == "/" ? 1 : folder.size() + 1;
    return begin < path.size() ? path.substr(begin) : ".";
}

std::string absolute(const std::string& path) {
    std::error_code error;
    return std::filesystem::absolute(path, error).string();
}

// Whether the rules are for this path.
bool is_confined(const std::string& path, const Confined& to) {
    return !to.folders.empty() && (!to.readable.empty() || !folder_of(path, to.folders).empty());
}

int open_confined(const std::string& path, const Confined& to, int flags) {
    if (!is_confined(path, to)) return ::open(path.c_str(), flags);
    char real[PATH_MAX];
    if (!::realpath(path.c_str(), real)) return -1;
    const std::string resolved = real, folder = folder_of(resolved, to.folders);
    if (!folder.empty()) return open_beneath(folder, below(resolved, folder), flags);
    // No link in a folder leads to what is named elsewhere.
    const bool reads = (flags & O_PATH) == 0 && folder_of(absolute(path), to.folders).empty() &&
                       !folder_of(resolved, to.readable).empty();
    if (reads) return ::open(resolved.c_str(), flags | O_NOFOLLOW);
    errno = EXDEV;
    return -1;
}

}  // namespace

void confine_files(const std::vector<std::string>& folders) {
    confine_files(folders, {});
}

void confine_files(const std::vector<std::string>& folders,
                   const std::vector<std::string>& readable) {
    const std::lock_guard lock(g_mutex);
    g_confined = {folders, readable};
}

ReadableFile::ReadableFile(const std::string& path, Pipes pipes) {
    const Confined to = confined();
    struct stat info = {};
    // A named pipe has to be opened once only, and by waiting.
    if (to.folders.empty() && pipes == Pipes::read_by_commands &&
        ::stat(path.c_str(), &info) == 0 && !S_ISREG(info.st_mode) && !S_ISDIR(info.st_mode)) {
        fd_ = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
        error_ = errno;
        return;
    }
    fd_ = open_confined(path, to, kFlags);
    error_ = errno;
    if (fd_ < 0) return;
    if (::fstat(fd_, &info) == 0 && S_ISREG(info.st_mode)) {
        bytes_ = uint64_t(info.st_size);
        return;
    }
    ::close(release());
    error_ = kNotAFile;
}

ReadableFile::~ReadableFile() {
    if (fd_ >= 0) ::close(fd_);
}

int ReadableFile::release() {
    return std::exchange(fd_, -1);
}

std::string ReadableFile::fault() const {
    return error_ == kNotAFile ? "is not a file" : reason_of_open(error_);
}

std::string ReadableFile::path() const {
    return "/proc/self/fd/" + std::to_string(fd_);
}

std::optional<std::string> ReadableFile::text(uint64_t most) const {
    if (!ok()) return std::nullopt;
    std::string text;
    char block[16384];
    for (;;) {
        const ssize_t got = ::read(fd_, block, sizeof(block));
        if (got < 0 && errno == EINTR) continue;
        if (got < 0) return std::nullopt;
        if (got == 0) return text;
        text.append(block, size_t(got));
        if (text.size() > most) return std::nullopt;
    }
}

std::string reason_of_open(int error) {
    if (error == EXDEV) return "is outside the folders that this process may use";
    return std::string("cannot be opened: ") + std::strerror(error);
}

// Commands use the path itself: they also run where /proc is missing.
OpenFolder::OpenFolder(const std::string& path) : path_(path.empty() ? "." : path) {
    const Confined to = confined();
    if (!is_confined(path_, to)) return;
    fd_ = open_confined(path_, to, kFolderFlags);
    error_ = fd_ < 0 ? errno : 0;
    path_ = "/proc/self/fd/" + std::to_string(fd_);
}

OpenFolder::OpenFolder(OpenFolder&& other) noexcept
    : path_(std::move(other.path_)), fd_(std::exchange(other.fd_, -1)), error_(other.error_) {}

OpenFolder::~OpenFolder() {
    if (fd_ >= 0) ::close(fd_);
}

std::string OpenFolder::at(const std::string& name) const {
    return path_ == "." ? name : path_ == "/" ? path_ + name : path_ + "/" + name;
}

int make_folders(const std::string& path) {
    namespace fs = std::filesystem;
    std::error_code error, ignored;
    const Confined to = confined();
    if (!is_confined(path, to)) {
        fs::create_directories(path, error);
        return fs::is_directory(path, ignored) ? 0 : error ? error.value() : ENOTDIR;
    }
    const std::string real = fs::weakly_canonical(absolute(path), error).string();
    const std::string folder = error ? "" : folder_of(real, to.folders);
    if (folder.empty()) return error ? error.value() : EXDEV;
    int at = ::open(folder.c_str(), kFolderFlags);
    int fault = at < 0 ? errno : 0;
    for (const fs::path& name : fs::path(below(real, folder))) {
        if (fault != 0) break;
        if (::mkdirat(at, name.c_str(), 0777) != 0 && errno != EEXIST) fault = errno;
        const int next = fault == 0 ? ::openat(at, name.c_str(), kFolderFlags | O_NOFOLLOW) : -1;
        if (fault == 0 && next < 0) fault = errno;
        ::close(std::exchange(at, next));
    }
    if (at >= 0) ::close(at);
    return fault;
}

std::string text_of_file(const std::string& path) {
    return ReadableFile(path).text(kMaxOwnText).value_or("");
}

}  // namespace postchain
