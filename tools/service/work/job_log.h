// The log and the counters of jobs, made from the events of the store: a line for each start, end
// and quarantined frame.
#pragma once

#include <functional>

#include "tools/service/store/job_store.h"
#include "tools/service/work/counters.h"
#include "tools/service/work/service.h"

namespace postchain::service {

// From any thread. `log` may be empty.
void log_event(const Event& event, const JobStore& store, Counters& counters,
               const std::function<void(const LogLine&)>& log) noexcept;

}  // namespace postchain::service
