// Files that are written completely or not at all.
//
//   create: .NAME.PID.tmp in the same folder --write--> fsync --rename--> NAME, fsync of the folder
//
// If the process is killed at any time, NAME holds the old file, the new one, or does not exist. A
// temporary that a killed process has left is not locked; the next job that writes NAME removes it
// (OutputFiles::remove_left_temporaries). The program must ignore SIGXFSZ, so that a file-size
// limit is reported as an error (EFBIG). A file that replaces another keeps that one's mode, owner,
// group and extended attributes, as far as the process may set them. All happens in the folder that
// was opened first (OpenFolder): a link that takes its place leads a service nowhere.
#pragma once

#include <linux/limits.h>

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "chain/base/readable_file.h"
#include "chain/base/status.h"

namespace postchain::io {

// The action of commit() if the final name exists. files/output_files.h decides which is allowed.
enum class OnExisting {
    fail,       // an error, also when another process makes the file first
    overwrite,  // replace it
    skip,       // keep the old file, drop the new one
    resume,     // of a run: as skip for its own outputs, as fail for others
};

// Bytes of the longest file name and path: their temporary has a dot, the process number and .tmp
// more.
constexpr size_t kLongestName = NAME_MAX - sizeof("..4194304.tmp") + 1;
constexpr size_t kLongestPath = PATH_MAX - sizeof("..4194304.tmp");

// Errors (output), before any work: the folder of `path` is missing or takes no files.
Status check_folder_of(const std::string& path);

// A descriptor that is closed at its end; negative: none.
class Descriptor {
  public:
    explicit Descriptor(int fd = -1) : fd_(fd) {}
    Descriptor(Descriptor&& other) noexcept : fd_(std::exchange(other.fd_, -1)) {}
    Descriptor& operator=(Descriptor&& other) noexcept {
        std::swap(fd_, other.fd_);
        return *this;
    }
    ~Descriptor();
    operator int() const { return fd_; }

  private:
    int fd_;
};

// An entry in the registry of live temporaries, until its end.
void delist(void* entry);
using LiveEntry = std::unique_ptr<void, void (*)(void*)>;

class AtomicFile {
  public:
    // Errors (output): missing folder, a file in place of the folder, a folder in place of the
    // file, no permission, another process writing the same temporary, name too long.
    static Result<AtomicFile> create(const std::string& path);

    AtomicFile(AtomicFile&&) = default;
    ~AtomicFile();  // removes the temporary unless committed

    // Buffered; a failure is reported here or by a later call, and by every call after that. Errors
    // (output): disk full, file-size limit, other write errors, with the system's reason.
    Status write(const void* bytes, size_t count);
    Status seek(uint64_t position);  // position of the next write; the file grows as needed
    Status flush();                  // makes written bytes readable from temporary()
    uint64_t position() const { return position_; }
    uint64_t size() const { return size_; }  // bytes written so far

    // Returns true if the file is in place, false if it was skipped. Errors (output): as write();
    // with `fail`, the name exists. If only the sync of the folder fails, the file is in place.
    Result<bool> commit(OnExisting on_existing);

    const std::string& path() const { return path_; }
    const std::string& temporary() const { return temporary_; }  // for calls of the system

  private:
    AtomicFile(const std::string& folder, std::string path, const std::string& name);
    Status fail(const char* action, int error);
    int move_here(OnExisting on_existing) const;  // 0 or errno; EEXIST: the name is taken
    void keep_attributes() const;                 // copies them from the file that will be replaced

    OpenFolder folder_;
    std::string path_;
    std::string target_;  // as path_, for calls of the system
    std::string temporary_;
    std::string buffer_;
    uint64_t buffer_start_ = 0;  // file position of buffer_[0]
    uint64_t position_ = 0;
    uint64_t size_ = 0;
    Descriptor fd_;
    LiveEntry live_{nullptr, delist};
    Status failed_;
};

// While it lives, no other process has one for the same file: for a file and others beside it that
// must be replaced together. It is a lock (flock) on .NAME.0.tmp, which counts as a temporary. On a
// file system without locks nothing is excluded.
class ReplaceLock {
  public:
    // Waits. Errors (output): the file to lock cannot be created.
    static Result<ReplaceLock> take(const std::string& path);

    ReplaceLock(ReplaceLock&&) = default;
    ~ReplaceLock();

    // Renames `companion`, which describes the locked file, to a temporary. The end of the lock
    // puts it back if the locked file is still the same one, and removes it otherwise.
    // remove_live_temporaries() removes it in either case. Errors (output): it cannot be renamed.
    Status set_aside(const std::string& companion);

  private:
    ReplaceLock(const std::string& folder, const std::string& name);
    OpenFolder folder_;
    std::string locked_;  // this and the following for calls of the system
    std::string path_;
    std::string aside_;  // empty: nothing
    uint64_t inode_ = 0;
    Descriptor fd_;
    LiveEntry live_{nullptr, delist};
    LiveEntry aside_live_{nullptr, delist};
};

// Removes every uncommitted temporary of this process. Safe in a signal handler; writers that are
// still running fail in commit().
void remove_live_temporaries();

// Whether `temporary` is the name of a temporary of the file `name`.
bool is_temporary_of(const std::string& temporary, const std::string& name);

// Removes temporaries in `folder` that killed processes have left, for files whose names `ours`
// accepts. Temporaries of running processes are locked and stay.
void remove_dead_temporaries(const std::string& folder,
                             const std::function<bool(const std::string& name)>& ours);

// Writes a text file, for sidecars. Returns false if skipped.
Result<bool> atomic_write_text(const std::string& path, std::string_view text,
                               OnExisting on_existing);

// A claim of one process on a piece of work, among several that share a folder.
//
// A claim is a lock (flock) on a file. The system releases it when the process ends in any way.
// Over NFS it works between machines if the file system is mounted with locks (the default of NFS
// 4).
class Claim {
  public:
    // Empty if another process holds it. Errors (output): the file cannot be created or locked.
    static Result<std::optional<Claim>> take(const std::string& path);

    // The work is done: removes the file too.
    void finish();

  private:
    Claim(OpenFolder folder, std::string name, Descriptor fd)
        : folder_(std::move(folder)), name_(std::move(name)), fd_(std::move(fd)) {}
    OpenFolder folder_;
    std::string name_;
    Descriptor fd_;
};

}  // namespace postchain::io
