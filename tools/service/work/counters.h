// Counters served at /metrics in the Prometheus text format. They start at 0 with the process.
#pragma once

#include <map>
#include <memory>
#include <string>

#include "tools/sequence/files/json.h"
#include "tools/service/store/job_store.h"

namespace postchain::service {

class Counters {
  public:
    Counters();
    ~Counters();

    // Callable from any thread; throws nothing.
    void add(const io::Json& frame) noexcept;  // a line of `postchain run --json`
    void ended(JobKind kind, const std::string& state) noexcept;  // a job
    // With the present state of the store, and the threads that hang.
    std::string text(const StoreUse& use, size_t stuck) const;

  private:
    struct Families;
    std::unique_ptr<Families> families_;
};

}  // namespace postchain::service
