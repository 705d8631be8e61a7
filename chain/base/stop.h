// Work that nobody waits for any more: the client has left, or was answered that it took too long.
//
// Whoever runs work for somebody else names the flag that tells so. What may compute for long
// (parsers, planners, loops over folders) asks now and then, and ends with an error.
#pragma once

#include <atomic>

#include "chain/base/status.h"

namespace postchain {

// The flag of this thread's work, while this object lives. `stop` outlives it. Null: no flag.
class StopFlag {
  public:
    explicit StopFlag(const std::atomic<bool>* stop);
    ~StopFlag();
    StopFlag(const StopFlag&) = delete;

  private:
    const std::atomic<bool>* before_;
};

// Whether nobody waits for this thread's work. Costs a few nanoseconds.
bool is_stopped();
// The error (internal) with which stopped work ends.
Status stopped_status();

}  // namespace postchain
