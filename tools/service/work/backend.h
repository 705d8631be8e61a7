// Runs the jobs of a store: on this machine (worker.h), or by another queue (remote_backend.h).
#pragma once

#include <string>

#include "chain/base/status.h"

namespace postchain::service {

struct BackendState {
    bool works = false;    // it can run jobs
    std::string renderer;  // of this machine's device, or the name of the other queue
    std::string trouble;   // why it cannot run jobs or record their ends; empty = it can
    size_t lost = 0;       // threads that hang
    size_t replaced = 0;   // threads that hung, since the start
    double oldest_step_s = 0;
    double step_limit_s = 0;  // of the running job; 0 = no limit
};

class Backend {
  public:
    virtual ~Backend() = default;
    virtual Status begin() = 0;
    virtual void wake() = 0;                           // there may be a new job
    virtual void stop_job(const std::string& id) = 0;  // after it was canceled
    // Ends the work within a frame, leaves unfinished jobs in the queue, and starts no other.
    virtual void drain() = 0;
    // drain(), then ends the threads. Returns the number of those that hang: what they use must
    // stay.
    virtual size_t end() = 0;
    // Remaining seconds of a job; 0 = unknown, or it does not run.
    virtual double remaining_s(const std::string& id) const = 0;
    virtual BackendState state() const = 0;
};

}  // namespace postchain::service
