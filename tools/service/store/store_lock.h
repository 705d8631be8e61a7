// One service at a time uses a store. SQLite's own exclusive lock would also stop backups.
#pragma once

#include <string>

#include "chain/status.h"

namespace postchain::service {

class StoreLock {
  public:
    StoreLock() = default;
    ~StoreLock();
    StoreLock(const StoreLock&) = delete;
    StoreLock& operator=(const StoreLock&) = delete;

    // Locks STORE.lock until this object or the process ends, beside the file that links lead to:
    // it is one store under every name. Errors (output): another service has it, or the file cannot
    // be created.
    Status take(const std::string& store);

  private:
    int file_ = -1;
};

}  // namespace postchain::service
