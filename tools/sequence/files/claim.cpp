#include "tools/sequence/files/claim.h"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

namespace postchain::io {

Result<std::optional<Claim>> Claim::take(const std::string& path) {
    const int fd = ::open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0666);
    if (fd < 0)
        return Status(StatusCode::output, path + ": cannot be made: " + std::strerror(errno));
    if (::flock(fd, LOCK_EX | LOCK_NB) == 0) return std::optional<Claim>(Claim(path, fd));
    const int error = errno;
    ::close(fd);
    if (error == EWOULDBLOCK) return std::optional<Claim>();
    return Status(StatusCode::output, path + ": cannot be locked: " + std::strerror(error));
}

Claim::Claim(Claim&& other) noexcept : path_(std::move(other.path_)), fd_(other.fd_) {
    other.fd_ = -1;
}

Claim::~Claim() {
    if (fd_ >= 0) ::close(fd_);
}

void Claim::finish() {
    ::unlink(path_.c_str());
}

}  // namespace postchain::io
