// LD_PRELOAD library that intercepts the system calls with which a program changes files. It
// numbers the calls that concern one folder, logs them, and makes one of them fail.
//
//   POSTCHAIN_FILE_CALLS_FOLDER=DIR   only files below DIR count; an absolute path
//   POSTCHAIN_FILE_CALLS_LOG=FILE     one line per call, separated by tabs:
//                                     number, call, path, second path of a rename, outcome
//   POSTCHAIN_FILE_CALLS_FAIL=N:HOW   what happens at call N:
//       ENOSPC, EIO                   it fails with this error
//       full                          the disk is full from call N on
//       short                         a write writes half of its data
//       kill                          the process gets SIGKILL instead
//
// Calls: create (open for writing), lock, write, sync_range, fsync, close, rename, link, unlink,
// mkdir, open_folder, fsync_folder. The outcome is ok, the error, short, or kill.
#include <dlfcn.h>
#include <fcntl.h>
#include <pthread.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <cerrno>
#include <climits>
#include <csignal>
#include <cstdarg>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <initializer_list>

namespace {

constexpr int kMaxFiles = 4096;

struct OpenFile {
    bool used = false;
    bool folder = false;
    char path[PATH_MAX] = {};
};

enum class How { never, error, full, cut, kill };

struct Watch {
    const char* folder = nullptr;  // null = nothing is watched
    int log = -1;
    long at = 0;  // number of the call that fails
    How how = How::never;
    int error = 0;
    long count = 0;
    OpenFile files[kMaxFiles];
};

// Calls come from several threads, and even before this library's constructors have run.
pthread_mutex_t mutex = PTHREAD_MUTEX_INITIALIZER;
pthread_once_t once = PTHREAD_ONCE_INIT;
Watch watch;

template <class Function>
Function next(const char* name, Function) {
    return reinterpret_cast<Function>(dlsym(RTLD_NEXT, name));
}
#define NEXT(name) next(#name, &name)

void begin() {
    const char* folder = std::getenv("POSTCHAIN_FILE_CALLS_FOLDER");
    if (folder == nullptr) return;
    if (const char* log = std::getenv("POSTCHAIN_FILE_CALLS_LOG"))
        watch.log = int(
            syscall(SYS_openat, AT_FDCWD, log, O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0666));
    if (const char* fail = std::getenv("POSTCHAIN_FILE_CALLS_FAIL")) {
        char* end = nullptr;
        watch.at = std::strtol(fail, &end, 10);
        const char* how = *end == ':' ? end + 1 : "";
        const struct {
            const char* name;
            How how;
            int error;
        } words[] = {{"ENOSPC", How::error, ENOSPC},
                     {"EIO", How::error, EIO},
                     {"full", How::full, ENOSPC},
                     {"short", How::cut, 0},
                     {"kill", How::kill, 0}};
        for (const auto& word : words)
            if (std::strcmp(how, word.name) == 0) {
                watch.how = word.how;
                watch.error = word.error;
            }
        if (watch.how == How::never) {
            std::fprintf(stderr, "POSTCHAIN_FILE_CALLS_FAIL=%s is not understood\n", fail);
            _exit(99);
        }
    }
    watch.folder = folder;
}

bool concerns(const char* path) {
    pthread_once(&once, begin);
    if (watch.folder == nullptr || path == nullptr) return false;
    const size_t length = std::strlen(watch.folder);
    return std::strncmp(path, watch.folder, length) == 0 &&
           (path[length] == '/' || path[length] == 0);
}

// The watched file of a descriptor, or null.
OpenFile* file_at(int fd) {
    pthread_once(&once, begin);
    if (watch.folder == nullptr || fd < 0 || fd >= kMaxFiles || !watch.files[fd].used)
        return nullptr;
    return &watch.files[fd];
}

void opened(int fd, const char* path, bool folder) {
    if (fd < 0 || fd >= kMaxFiles) return;
    OpenFile& file = watch.files[fd];
    file.used = true;
    file.folder = folder;
    std::snprintf(file.path, sizeof(file.path), "%s", path);
}

void note(long number, const char* call, const char* path, const char* to, const char* outcome) {
    if (watch.log < 0) return;
    char line[2 * PATH_MAX + 100];
    const int length =
        std::snprintf(line, sizeof(line), "%ld\t%s\t%s\t%s\t%s\n", number, call, path, to, outcome);
    (void)!syscall(SYS_write, watch.log, line, size_t(length));
}

// Whether the call fails on a full disk.
bool takes_room(const char* call) {
    for (const char* one : {"create", "write", "fsync", "rename", "link", "mkdir"})
        if (std::strcmp(call, one) == 0) return true;
    return false;
}

struct Verdict {
    int error = 0;      // error to return, or 0 to make the call
    bool half = false;  // writes half
};

// Counts and logs a call before it is made, and decides its outcome.
Verdict judge(const char* call, const char* path, const char* to = "") {
    const long number = ++watch.count;
    Verdict verdict;
    const char* outcome = "ok";
    if (watch.how == How::full && number >= watch.at && takes_room(call)) {
        verdict.error = watch.error;
        outcome = "ENOSPC";
    }
    if (number == watch.at) {
        if (watch.how == How::kill) {
            note(number, call, path, to, "kill");
            raise(SIGKILL);
        }
        if (watch.how == How::error) {
            verdict.error = watch.error;
            outcome = strerrorname_np(watch.error);
        }
        if (watch.how == How::cut && std::strcmp(call, "write") == 0) {
            verdict.half = true;
            outcome = "short";
        }
    }
    note(number, call, path, to, outcome);
    return verdict;
}

class Locked {
  public:
    Locked() { pthread_mutex_lock(&mutex); }
    ~Locked() { pthread_mutex_unlock(&mutex); }
};

// Makes the call unless it must fail. Calls are serialized, so that the log is in order.
template <class Real>
auto judged(const char* call, const char* path, const char* to, Real real) {
    if (const Verdict verdict = judge(call, path, to); verdict.error != 0) {
        errno = verdict.error;
        return decltype(real())(-1);
    }
    return real();
}

template <class Real>
int open_judged(const char* path, int flags, Real real) {
    const bool writes = (flags & O_ACCMODE) != O_RDONLY || (flags & O_CREAT) != 0;
    const bool folder = (flags & O_DIRECTORY) == O_DIRECTORY && (flags & O_TMPFILE) != O_TMPFILE;
    if (!concerns(path) || (!writes && !folder)) return real();
    const Locked locked;
    const int fd = judged(folder ? "open_folder" : "create", path, "", real);
    opened(fd, path, folder);
    return fd;
}

template <class Real>
ssize_t write_judged(int fd, size_t count, Real real) {
    const OpenFile* file = file_at(fd);
    if (file == nullptr) return real(count);
    const Locked locked;
    const Verdict verdict = judge("write", file->path);
    if (verdict.error != 0) {
        errno = verdict.error;
        return -1;
    }
    return real(verdict.half && count > 1 ? count / 2 : count);
}

template <class Real>
int file_judged(const char* call, int fd, Real real) {
    const OpenFile* file = file_at(fd);
    if (file == nullptr) return real();
    const Locked locked;
    return judged(call, file->path, "", real);
}

template <class Real>
int path_judged(const char* call, const char* path, const char* to, Real real) {
    if (!concerns(path) && !concerns(to)) return real();
    const Locked locked;
    return judged(call, path, to, real);
}

void note_stream(const char* path, const char* mode) {
    if (!concerns(path) || std::strpbrk(mode, "wa+") == nullptr) return;
    const Locked locked;
    judge("create", path);
}

mode_t mode_of(int flags, va_list& rest) {
    return (flags & O_CREAT) != 0 ? va_arg(rest, mode_t) : 0;
}

}  // namespace

extern "C" {

int open(const char* path, int flags, ...) {
    va_list rest;
    va_start(rest, flags);
    const mode_t mode = mode_of(flags, rest);
    va_end(rest);
    return open_judged(path, flags, [&] { return NEXT(open)(path, flags, mode); });
}

int open64(const char* path, int flags, ...) {
    va_list rest;
    va_start(rest, flags);
    const mode_t mode = mode_of(flags, rest);
    va_end(rest);
    return open_judged(path, flags, [&] { return NEXT(open64)(path, flags, mode); });
}

int openat(int folder, const char* path, int flags, ...) {
    va_list rest;
    va_start(rest, flags);
    const mode_t mode = mode_of(flags, rest);
    va_end(rest);
    // A folder opened for listing: changes no file.
    if ((flags & O_DIRECTORY) != 0) return NEXT(openat)(folder, path, flags, mode);
    return open_judged(path, flags, [&] { return NEXT(openat)(folder, path, flags, mode); });
}

// Opened by C++ streams and C programs; shows if a watched file is written in this way.
FILE* fopen(const char* path, const char* mode) {
    note_stream(path, mode);
    return NEXT(fopen)(path, mode);
}

FILE* fopen64(const char* path, const char* mode) {
    note_stream(path, mode);
    return NEXT(fopen64)(path, mode);
}

ssize_t write(int fd, const void* bytes, size_t count) {
    return write_judged(fd, count, [&](size_t n) { return NEXT(write)(fd, bytes, n); });
}

ssize_t pwrite(int fd, const void* bytes, size_t count, off_t at) {
    return write_judged(fd, count, [&](size_t n) { return NEXT(pwrite)(fd, bytes, n, at); });
}

ssize_t pwrite64(int fd, const void* bytes, size_t count, off64_t at) {
    return write_judged(fd, count, [&](size_t n) { return NEXT(pwrite64)(fd, bytes, n, at); });
}

int sync_file_range(int fd, off64_t at, off64_t count, unsigned flags) {
    return file_judged("sync_range", fd,
                       [&] { return NEXT(sync_file_range)(fd, at, count, flags); });
}

int flock(int fd, int operation) {
    return file_judged("lock", fd, [&] { return NEXT(flock)(fd, operation); });
}

int fsync(int fd) {
    const OpenFile* file = file_at(fd);
    return file_judged(file != nullptr && file->folder ? "fsync_folder" : "fsync", fd,
                       [&] { return NEXT(fsync)(fd); });
}

int fdatasync(int fd) {
    return file_judged("fsync", fd, [&] { return NEXT(fdatasync)(fd); });
}

// On Linux a descriptor is closed even if close() fails.
int close(int fd) {
    OpenFile* file = file_at(fd);
    if (file == nullptr) return NEXT(close)(fd);
    const Locked locked;
    const Verdict verdict = judge("close", file->path);
    file->used = false;
    const int result = NEXT(close)(fd);
    if (verdict.error == 0) return result;
    errno = verdict.error;
    return -1;
}

int rename(const char* from, const char* to) noexcept {
    return path_judged("rename", from, to, [&] { return NEXT(rename)(from, to); });
}

int renameat2(int from_folder, const char* from, int to_folder, const char* to,
              unsigned flags) noexcept {
    return path_judged("rename", from, to,
                       [&] { return NEXT(renameat2)(from_folder, from, to_folder, to, flags); });
}

int link(const char* from, const char* to) noexcept {
    return path_judged("link", from, to, [&] { return NEXT(link)(from, to); });
}

int unlink(const char* path) noexcept {
    return path_judged("unlink", path, "", [&] { return NEXT(unlink)(path); });
}

int mkdir(const char* path, mode_t mode) noexcept {
    return path_judged("mkdir", path, "", [&] { return NEXT(mkdir)(path, mode); });
}

}  // extern "C"
