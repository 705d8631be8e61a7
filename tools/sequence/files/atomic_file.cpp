#include "tools/sequence/files/atomic_file.h"

#include <fcntl.h>
#include <linux/limits.h>
#include <stdio.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <sys/xattr.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <climits>
#include <cstring>
#include <filesystem>
#include <mutex>
#include <utility>
#include <vector>

namespace postchain::io {
namespace {

constexpr size_t kBufferBytes = size_t(1) << 20;

// The registry is a list that only grows and whose entries are reused, so that a signal handler
// can walk it without a lock.
struct LiveTemporary {
    std::atomic<bool> live = false;
    char path[PATH_MAX] = {};  // for calls of the system
    std::string name;          // its path without OpenFolder
    LiveTemporary* next = nullptr;
};
std::atomic<LiveTemporary*> live_list = nullptr;
std::mutex live_mutex;  // for adding and reusing entries; the signal handler does not lock it

// Null if this process already writes a temporary of this name.
LiveEntry enlist(const std::string& name, const std::string& path) {
    const std::lock_guard lock(live_mutex);
    LiveTemporary* entry = nullptr;
    for (LiveTemporary* e = live_list.load(); e != nullptr; e = e->next) {
        if (!e->live.load()) {
            entry = e;
        } else if (name == e->name) {
            return {nullptr, delist};
        }
    }
    const bool fresh = entry == nullptr;
    if (fresh) entry = new LiveTemporary;
    entry->name = name;
    std::memcpy(entry->path, path.c_str(), path.size() + 1);
    entry->live.store(true);
    if (fresh) {
        entry->next = live_list.load();
        live_list.store(entry);
    }
    return {entry, delist};
}

Status output_error(const std::string& path, const std::string& what) {
    return Status(StatusCode::output, concat(path, ": ", what));
}

// Explains an errno and gives a remedy.
std::string reason_of(int error) {
    switch (error) {
        case ENOSPC:
            return "disk full; free some space, or write elsewhere";
        case EDQUOT:
            return "disk quota exceeded; free some space, or write elsewhere";
        case EFBIG:
            return "file-size limit reached (see ulimit -f)";
        case EROFS:
            return "the file system is read-only; write elsewhere";
        case EACCES:
        case EPERM:
            return "no permission to write here; change it, or write elsewhere";
        case ENAMETOOLONG:
            return "the name is too long (the temporary adds a dot, the process number and .tmp)";
        default:
            return std::strerror(error);
    }
}

// Why a file cannot be made in `folder`, more precisely than errno.
std::string why_not_in(const std::string& folder, int error) {
    struct stat info;
    if (error == EXDEV) return concat("folder ", folder, " ", reason_of_open(error));
    if (::stat(folder.c_str(), &info) == 0) {
        if (!S_ISDIR(info.st_mode)) return concat(folder, " is a file, not a folder");
        return concat("cannot write in folder ", folder, ": ", reason_of(error));
    }
    if (errno == ENOTDIR) {
        namespace fs = std::filesystem;
        for (fs::path p = folder; !p.empty() && p != p.parent_path(); p = p.parent_path()) {
            std::error_code ignored;
            if (fs::exists(p, ignored) && !fs::is_directory(p, ignored))
                return concat(p.string(), " is a file, not a folder");
        }
    }
    if (errno == ENOENT || errno == ENOTDIR)
        return concat("folder ", folder, " does not exist; create it first");
    return concat("cannot write in folder ", folder, ": ", reason_of(errno));
}

// Renames without replacing; 0 or errno. link() serves file systems without RENAME_NOREPLACE.
int rename_to_new(const std::string& from, const std::string& to) {
    if (::renameat2(AT_FDCWD, from.c_str(), AT_FDCWD, to.c_str(), RENAME_NOREPLACE) == 0) return 0;
    if (errno != EINVAL && errno != ENOSYS) return errno;
    if (::link(from.c_str(), to.c_str()) != 0) return errno;
    ::unlink(from.c_str());
    return 0;
}

// Some file systems have no locks; then every temporary is taken for one of a running process.
bool has_no_locks(int error) {
    return error == ENOLCK || error == ENOSYS || error == EOPNOTSUPP;
}

// Removes a temporary that no process has locked: its writer was killed. True if it was removed.
bool remove_if_dead(const std::string& path) {
    const int fd = ::open(path.c_str(), O_WRONLY | O_NOFOLLOW | O_CLOEXEC);
    if (fd < 0) return errno == ENOENT;
    const bool dead = ::flock(fd, LOCK_EX | LOCK_NB) == 0 && ::unlink(path.c_str()) == 0;
    ::close(fd);
    return dead;
}

struct Opened {
    enum class Step { open, lock };
    int fd = -1;
    int error = 0;  // errno of the failed step; EEXIST of `open`: another process has the name
    Step step = Step::open;
};

// Creates and locks the temporary. Removes a file of this name that a killed process has left, or
// one with the same process number in another container.
Opened open_temporary(const std::string& path) {
    // Between open() and the lock another process may remove the file as a left one; then it is
    // created again.
    constexpr int kAttempts = 16;
    for (int attempt = 0; attempt < kAttempts; ++attempt) {
        const int fd = ::open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
        if (fd < 0) {
            if (errno != EEXIST) return {-1, errno, Opened::Step::open};
            if (!remove_if_dead(path)) break;
            continue;
        }
        struct stat info;
        const int error = ::flock(fd, LOCK_EX | LOCK_NB) == 0 ? 0 : errno;
        const bool held = error == 0 || has_no_locks(error);
        if (held && ::fstat(fd, &info) == 0 && info.st_nlink > 0) return {fd, 0, {}};
        if (!held && error != EWOULDBLOCK) {
            ::unlink(path.c_str());
            ::close(fd);
            return {-1, error, Opened::Step::lock};
        }
        ::close(fd);
    }
    return {-1, EEXIST, Opened::Step::open};
}

std::string temporary_of(const std::string& name, int number) {
    return concat(".", name, ".", number, ".tmp");
}

std::string own_name(const std::string& path) {
    return path.substr(path.rfind('/') + 1);  // npos + 1 is 0
}

std::string own_folder(const std::string& path) {
    const size_t slash = path.rfind('/');
    return slash == std::string::npos ? "." : path.substr(0, std::max<size_t>(slash, 1));
}

// 0 if there is no file.
uint64_t inode_of(const std::string& path) {
    struct stat info;
    return ::stat(path.c_str(), &info) == 0 ? info.st_ino : 0;
}

// NAME of a temporary .NAME.PID.tmp, or nothing.
std::string name_of_temporary(const std::string& temporary) {
    constexpr std::string_view kEnd = ".tmp";
    if (!temporary.starts_with('.') || !temporary.ends_with(kEnd)) return "";
    const size_t end = temporary.size() - kEnd.size();
    const size_t dot = temporary.rfind('.', end - 1);
    if (dot == 0 || dot + 1 == end) return "";
    for (size_t i = dot + 1; i < end; ++i)
        if (temporary[i] < '0' || temporary[i] > '9') return "";
    return temporary.substr(1, dot - 1);
}

}  // namespace

Descriptor::~Descriptor() {
    if (fd_ >= 0) ::close(fd_);
}

void delist(void* entry) {
    const std::lock_guard lock(live_mutex);
    static_cast<LiveTemporary*>(entry)->live.store(false);
}

Status check_folder_of(const std::string& path) {
    const std::string folder = own_folder(path);
    if (::access((folder + "/").c_str(), W_OK | X_OK) == 0) return Status();
    return output_error(path, why_not_in(folder, errno));
}

AtomicFile::AtomicFile(const std::string& folder, std::string path, const std::string& name)
    : folder_(folder),
      path_(std::move(path)),
      target_(folder_.at(name)),
      temporary_(folder_.at(temporary_of(name, ::getpid()))) {}

Result<AtomicFile> AtomicFile::create(const std::string& path) try {
    const std::string name = own_name(path), folder = own_folder(path);
    if (name.empty()) return output_error(path, "no file name; add one");
    AtomicFile file(folder, path, name);
    if (file.folder_.error() != 0)
        return output_error(path, why_not_in(folder, file.folder_.error()));
    if (file.temporary_.size() >= PATH_MAX) return output_error(path, reason_of(ENAMETOOLONG));
    struct stat info;
    if (::stat(file.target_.c_str(), &info) == 0 && S_ISDIR(info.st_mode))
        return output_error(path, "is a folder, not a file; choose another name");
    // Registered before it exists, so that a signal at any time finds it.
    const std::string temporary =
        path.substr(0, path.size() - name.size()) + own_name(file.temporary_);
    LiveEntry live = enlist(temporary, file.temporary_);
    if (!live)
        return output_error(path, "is already being written by this process; choose another name");
    const Opened opened = open_temporary(file.temporary_);
    if (opened.fd < 0) {
        const std::string why =
            opened.step == Opened::Step::lock ? concat("cannot lock it: ", reason_of(opened.error))
            : opened.error == EEXIST          ? concat("another process is writing ", temporary)
                                              : why_not_in(folder, opened.error);
        return output_error(path, why);
    }
    file.fd_ = Descriptor(opened.fd);
    file.live_ = std::move(live);
    file.buffer_.reserve(kBufferBytes);
    return file;
} catch (...) {
    return status_of_exception(path);
}

AtomicFile::~AtomicFile() {
    if (live_) ::unlink(temporary_.c_str());
}

Status AtomicFile::fail(const char* action, int error) {
    if (failed_.ok()) failed_ = output_error(path_, concat(action, ": ", reason_of(error)));
    return failed_;
}

Status AtomicFile::flush() try {
    const char* bytes = buffer_.data();
    size_t left = buffer_.size();
    uint64_t at = buffer_start_;
    while (left > 0 && failed_.ok()) {
        const ssize_t n = ::pwrite(fd_, bytes, left, off_t(at));
        if (n < 0 && errno == EINTR) continue;
        if (n <= 0) {
            const int error = n < 0 ? errno : ENOSPC;
            (void)fail("cannot write", error);
            break;
        }
        bytes += n;
        left -= size_t(n);
        at += uint64_t(n);
    }
    // Starts writing to disk before the fsync; a failure does not matter.
    if (failed_.ok()) {
        ::sync_file_range(fd_, off64_t(buffer_start_), off64_t(buffer_.size()),
                          SYNC_FILE_RANGE_WRITE);
    }
    buffer_.clear();
    buffer_start_ = position_;
    return failed_;
} catch (...) {
    return failed_ = status_of_exception(path_);
}

Status AtomicFile::write(const void* bytes, size_t count) try {
    if (!failed_.ok()) return failed_;
    if (buffer_.size() + count > kBufferBytes) RETURN_IF_ERROR(flush());
    buffer_.append(static_cast<const char*>(bytes), count);
    position_ += count;
    size_ = std::max(size_, position_);
    return buffer_.size() >= kBufferBytes ? flush() : Status();
} catch (...) {
    return failed_ = status_of_exception(path_);
}

Status AtomicFile::seek(uint64_t position) try {
    if (position == position_) return failed_;
    Status s = flush();
    position_ = position;
    buffer_start_ = position;
    return s;
} catch (...) {
    return failed_ = status_of_exception(path_);
}

Result<bool> AtomicFile::commit(OnExisting on_existing) try {
    RETURN_IF_ERROR(flush());
    if (::fsync(fd_) != 0) return fail("cannot write", errno);
    // Opened before the rename, so that a failure leaves no file. A folder that can be written but
    // not read cannot be synced.
    const int folder = ::open(folder_.path().c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    if (folder < 0 && errno != EACCES && errno != EPERM)
        return fail("cannot open its folder to sync it", errno);
    const int error = move_here(on_existing);
    // The new name is on disk only after a sync of the folder. Some file systems cannot sync a
    // folder; the file itself is already synced.
    int folder_error = 0;
    if (folder >= 0) {
        if (error == 0 && ::fsync(folder) != 0 && errno != EINVAL && errno != ENOSYS &&
            errno != EOPNOTSUPP)
            folder_error = errno;
        ::close(folder);
    }
    if (error == EEXIST && on_existing == OnExisting::skip) return false;
    if (error == EEXIST && on_existing == OnExisting::fail) {
        failed_ =
            output_error(path_, "exists already, and is not replaced; move it, or write elsewhere");
        return failed_;
    }
    if (error != 0) return fail("cannot move the finished file here", error);
    live_.reset();
    fd_ = Descriptor();
    if (folder_error != 0)
        return fail("is complete, but the disk may not keep its name: its folder cannot be synced",
                    folder_error);
    return true;
} catch (...) {
    return status_of_exception(path_);
}

int AtomicFile::move_here(OnExisting on_existing) const {
    if (on_existing != OnExisting::overwrite) return rename_to_new(temporary_, target_);
    keep_attributes();
    return ::rename(temporary_.c_str(), target_.c_str()) == 0 ? 0 : errno;
}

// Only root can give a file away, and some file systems have no attributes: what cannot be kept is
// as for a new file.
void AtomicFile::keep_attributes() const {
    struct stat old;
    if (::lstat(target_.c_str(), &old) != 0 || !S_ISREG(old.st_mode)) return;
    if (::fchown(fd_, old.st_uid, old.st_gid) != 0) (void)!::fchown(fd_, uid_t(-1), old.st_gid);
    (void)!::fchmod(fd_, old.st_mode & 0777);
    std::vector<char> names(
        size_t(std::max<ssize_t>(::llistxattr(target_.c_str(), nullptr, 0), 0)));
    const ssize_t listed = ::llistxattr(target_.c_str(), names.data(), names.size());
    std::vector<char> value(XATTR_SIZE_MAX);
    for (ssize_t at = 0; at < listed; at += ssize_t(std::strlen(&names[size_t(at)])) + 1) {
        const char* name = &names[size_t(at)];
        const ssize_t bytes = ::lgetxattr(target_.c_str(), name, value.data(), value.size());
        if (bytes >= 0) (void)!::fsetxattr(fd_, name, value.data(), size_t(bytes), 0);
    }
}

ReplaceLock::ReplaceLock(const std::string& folder, const std::string& name)
    : folder_(folder), locked_(folder_.at(name)), path_(folder_.at(temporary_of(name, 0))) {}

Result<ReplaceLock> ReplaceLock::take(const std::string& path) {
    ReplaceLock lock(own_folder(path), own_name(path));
    if (lock.folder_.error() != 0)
        return output_error(path, why_not_in(own_folder(path), lock.folder_.error()));
    for (;;) {
        lock.fd_ = Descriptor(
            ::open(lock.path_.c_str(), O_WRONLY | O_CREAT | O_NOFOLLOW | O_CLOEXEC, 0666));
        if (lock.fd_ < 0) return output_error(path, concat("cannot lock it: ", reason_of(errno)));
        int locked;
        do locked = ::flock(lock.fd_, LOCK_EX);
        while (locked != 0 && errno == EINTR);
        struct stat info;
        // The one before may have removed the file.
        if (locked != 0 || ::fstat(lock.fd_, &info) != 0 || info.st_nlink > 0) break;
    }
    lock.live_ = enlist(lock.path_, lock.path_);
    return lock;
}

Status ReplaceLock::set_aside(const std::string& companion) {
    inode_ = inode_of(locked_);
    const std::string there = folder_.at(own_name(companion));
    const std::string temporary = folder_.at(temporary_of(own_name(companion), 0));
    if (::rename(there.c_str(), temporary.c_str()) != 0)
        return output_error(companion, concat("cannot replace it: ", reason_of(errno)));
    aside_ = there;
    aside_live_ = enlist(temporary, temporary);
    return Status();
}

ReplaceLock::~ReplaceLock() {
    if (fd_ < 0) return;
    if (!aside_.empty()) {
        const std::string temporary = folder_.at(temporary_of(own_name(aside_), 0));
        if (inode_of(locked_) != inode_ || rename_to_new(temporary, aside_) != 0)
            ::unlink(temporary.c_str());
    }
    ::unlink(path_.c_str());
}

bool is_temporary_of(const std::string& temporary, const std::string& name) {
    return !name.empty() && name_of_temporary(temporary) == name;
}

void remove_dead_temporaries(const std::string& folder,
                             const std::function<bool(const std::string& name)>& ours) {
    const OpenFolder in(folder);
    std::error_code error;
    std::vector<std::string> found;
    for (std::filesystem::directory_iterator it(in.path(), error), end; !error && it != end;
         it.increment(error)) {
        const std::string temporary = it->path().filename().string();
        const std::string name = name_of_temporary(temporary);
        if (!name.empty() && ours(name)) found.push_back(it->path().string());
    }
    for (const std::string& path : found) remove_if_dead(path);
}

void remove_live_temporaries() {
    const int saved = errno;
    for (LiveTemporary* e = live_list.load(); e != nullptr; e = e->next)
        if (e->live.load()) ::unlink(e->path);
    errno = saved;
}

Result<bool> atomic_write_text(const std::string& path, std::string_view text,
                               OnExisting on_existing) try {
    ASSIGN_OR_RETURN(AtomicFile file, AtomicFile::create(path));
    RETURN_IF_ERROR(file.write(text.data(), text.size()));
    return file.commit(on_existing);
} catch (...) {
    return status_of_exception(path);
}

Result<std::optional<Claim>> Claim::take(const std::string& path) {
    OpenFolder folder(own_folder(path));
    if (folder.error() != 0)
        return output_error(path, why_not_in(own_folder(path), folder.error()));
    std::string name = own_name(path);
    Descriptor fd(::open(folder.at(name).c_str(), O_RDWR | O_CREAT | O_NOFOLLOW | O_CLOEXEC, 0666));
    if (fd < 0)
        return Status(StatusCode::output, path + ": cannot be made: " + std::strerror(errno));
    if (::flock(fd, LOCK_EX | LOCK_NB) == 0)
        return std::optional<Claim>(Claim(std::move(folder), std::move(name), std::move(fd)));
    if (errno == EWOULDBLOCK) return std::optional<Claim>();
    return Status(StatusCode::output, path + ": cannot be locked: " + std::strerror(errno));
}

void Claim::finish() {
    ::unlink(folder_.at(name_).c_str());
}

}  // namespace postchain::io
