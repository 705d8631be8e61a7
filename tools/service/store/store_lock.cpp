#include "tools/service/store/store_lock.h"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>

namespace postchain::service {

StoreLock::~StoreLock() {
    if (file_ >= 0) ::close(file_);
}

Status StoreLock::take(const std::string& store) {
    std::error_code error;
    const auto file = std::filesystem::weakly_canonical(store, error);
    const std::string path = (error ? store : file.string()) + ".lock";
    file_ = ::open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0600);
    if (file_ < 0)
        return Status(StatusCode::output, concat(path, ": ", std::strerror(errno),
                                                 "; choose another folder for the store"));
    if (::flock(file_, LOCK_EX | LOCK_NB) == 0) return Status();
    return Status(StatusCode::output,
                  store + ": another service uses this store; stop it, or choose another file");
}

}  // namespace postchain::service
