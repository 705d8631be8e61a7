// Signals of long verbs: the first SIGINT, SIGTERM or SIGHUP asks to stop after the work under way,
// the second ends the process at once. Either way no temporary file stays behind.
#pragma once

#include <atomic>

namespace postchain {

class StopOnSignal {
  public:
    StopOnSignal();   // installs the handlers
    ~StopOnSignal();  // removes what temporaries are left when a stop was asked for

    bool asked() const { return flag(); }
    const std::atomic<bool>& flag() const;
    int exit_code() const;  // 128 + the signal's number: 130, 143, 129
};

}  // namespace postchain
