// Files that are written completely or not at all.
//
//   create: .NAME.PID.tmp in the same folder --write--> fsync --rename--> NAME, fsync of the folder
//
// Whatever kills the process, NAME holds the old file, the new one, or nothing. A temporary left
// by a killed process carries no lock; the next job that writes NAME removes it
// (OutputFiles::remove_left_temporaries).
// A file-size limit must reach us as an error (EFBIG): the program ignores SIGXFSZ, not this file.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <string_view>

#include "chain/status.h"

namespace postchain::io {

// What commit() does when the final name exists. Which of them is allowed is decided in one place:
// files/output_files.h.
enum class OnExisting {
    fail,       // an error, also when another process makes the file first
    overwrite,  // replace it
    skip,       // keep the old file, drop the new one
};

// What `fail` and `skip` can say before any work: true where the file is there and stays, an error
// (output) where it is there under `fail`. AtomicFile::commit() decides for good.
Result<bool> skipped_already(const std::string& path, OnExisting on_existing);

class AtomicFile {
  public:
    // Errors (output): folder missing, a file where a folder should be, a folder where the file
    // should be, no permission, another process writing the same temporary, the name too long.
    static Result<AtomicFile> create(const std::string& path);

    AtomicFile(AtomicFile&& other) noexcept;
    AtomicFile& operator=(AtomicFile&&) = delete;
    ~AtomicFile();  // removes the temporary unless committed

    // Buffered; a failure is reported here or by a later call and sticks. Errors (output): disk
    // full, file-size limit, any other write error, with the system's reason.
    Status write(const void* bytes, size_t count);
    Status seek(uint64_t position);  // of the next write; the file grows as needed
    Status flush();                  // what was written can be read from temporary()
    uint64_t position() const { return position_; }
    uint64_t size() const { return size_; }  // bytes written so far

    // True when the file is in place, false when it was skipped. Errors (output): as write(), a
    // name that is taken under `fail`. Where only the sync of the folder fails, the file is in
    // place.
    Result<bool> commit(OnExisting on_existing);

    const std::string& path() const { return path_; }
    const std::string& temporary() const { return temporary_; }

  private:
    AtomicFile() = default;
    Status fail(const char* action, int error);
    int move_here(OnExisting on_existing) const;  // 0 or errno; EEXIST: the name is taken

    std::string path_;
    std::string temporary_;
    std::string folder_;
    std::string buffer_;
    uint64_t buffer_start_ = 0;  // file position of buffer_[0]
    uint64_t position_ = 0;
    uint64_t size_ = 0;
    int fd_ = -1;
    void* live_ = nullptr;  // entry in the registry of live temporaries
    Status failed_;
};

// Removes every temporary of this process that is not committed yet. Safe in a signal handler;
// writers still running then fail in commit().
void remove_live_temporaries();

// Whether a file name is that of a temporary of the file `name`.
bool is_temporary_of(const std::string& temporary, const std::string& name);

// Removes temporaries in `folder` that killed processes have left, of the files whose names `ours`
// accepts. What a process still writes is locked, and stays.
void remove_dead_temporaries(const std::string& folder,
                             const std::function<bool(const std::string& name)>& ours);

// A whole text file at once, for sidecars. False when skipped.
Result<bool> atomic_write_text(const std::string& path, std::string_view text,
                               OnExisting on_existing);

}  // namespace postchain::io
