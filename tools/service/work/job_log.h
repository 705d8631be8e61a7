// The log and the counters of jobs, made from the events of the store: a line for each start, end
// and quarantined frame.
#pragma once

#include <functional>

#include "tools/service/store/job_store.h"
#include "tools/service/work/counters.h"
#include "tools/service/work/service.h"

namespace postchain::service {

class JobLog {
  public:
    // The arguments outlive this object.
    JobLog(const JobStore& store, Counters& counters, std::function<void(const LogLine&)> log)
        : store_(store), counters_(counters), log_(std::move(log)) {}

    void enter(const Event& event) noexcept;  // from any thread

  private:
    const JobStore& store_;
    Counters& counters_;
    const std::function<void(const LogLine&)> log_;
};

}  // namespace postchain::service
