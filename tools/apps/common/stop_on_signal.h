// Signals during long subcommands: the first SIGINT, SIGTERM or SIGHUP stops after the work under
// way, the second ends the process at once. Neither leaves temporary files.
#pragma once

#include <atomic>
#include <string>

namespace postchain {

class StopOnSignal {
  public:
    // Installs the handlers. `reloads`: SIGHUP does not stop, see asked_to_reload().
    explicit StopOnSignal(bool reloads = false);
    ~StopOnSignal();  // removes remaining temporaries if a stop was requested

    bool asked() const { return flag(); }
    static bool asked_to_reload();  // true once for each SIGHUP
    const std::atomic<bool>& flag() const;
    int exit_code() const;  // 128 + the signal's number: 130, 143, 129
    // Warns that the command was interrupted, with what is done and how to go on; the exit code.
    int interrupted(const std::string& how_to_go_on) const;
};

}  // namespace postchain
