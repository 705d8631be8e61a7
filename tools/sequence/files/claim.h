// A claim of one process on a piece of work, among several that share a folder.
//
// A claim is a lock (flock) on a file. The system releases it when the process ends in any way.
// Over NFS it works between machines if the file system is mounted with locks (the default of NFS
// 4).
#pragma once

#include <optional>
#include <string>

#include "chain/status.h"

namespace postchain::io {

class Claim {
  public:
    // Empty if another process holds it. Errors (output): the file cannot be created or locked.
    static Result<std::optional<Claim>> take(const std::string& path);

    Claim(Claim&& other) noexcept;
    Claim& operator=(Claim&&) = delete;
    ~Claim();  // releases it

    // The work is done: removes the file too.
    void finish();

  private:
    Claim(std::string path, int fd) : path_(std::move(path)), fd_(fd) {}
    std::string path_;
    int fd_ = -1;
};

}  // namespace postchain::io
