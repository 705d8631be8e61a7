// A claim of one process on a piece of work, among several that share a folder.
//
// It is a lock (flock) on a file: the system takes it back when the process ends, however it ends,
// so that a claim never outlives its owner. Over NFS the lock holds between machines where the
// file system is mounted with locks (the default of NFS 4).
#pragma once

#include <optional>
#include <string>

#include "chain/status.h"

namespace postchain::io {

class Claim {
  public:
    // Nothing when another process has it. Errors (output): the file cannot be made or locked.
    static Result<std::optional<Claim>> take(const std::string& path);

    Claim(Claim&& other) noexcept;
    Claim& operator=(Claim&&) = delete;
    ~Claim();  // gives it back

    // The work is done: removes the file too.
    void finish();

  private:
    Claim(std::string path, int fd) : path_(std::move(path)), fd_(fd) {}
    std::string path_;
    int fd_ = -1;
};

}  // namespace postchain::io
