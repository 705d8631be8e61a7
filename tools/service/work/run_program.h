// Programs that are run for their output, with a time limit on everything: start, input, output and
// end.
//
// posix_spawn of glibc 2.34 closes all other descriptors in the child. Boost.Process 1.74, which
// Debian 12 has, waits with a limit by forking a second process, so it is not used here.
#pragma once

#include <atomic>
#include <chrono>
#include <string>
#include <vector>

#include "chain/base/status.h"

namespace postchain::service {

struct ProgramResult {
    int exit_code = 0;
    std::string out, err;
};

// Runs a program with `input` on its standard input, and reads what it prints. It inherits only its
// three standard streams. After `limit`, or kStopGrace after `stop` was set, it is killed with its
// process group. Errors (output): it cannot be started, was killed, or prints too much.
inline constexpr std::chrono::milliseconds kStopGrace{2000};
Result<ProgramResult> run_program(const std::vector<std::string>& words, const std::string& input,
                                  std::chrono::milliseconds limit,
                                  const std::atomic<bool>* stop = nullptr);

// For a shell: 'it'\''s'.
std::string shell_quoted(const std::string& word);

}  // namespace postchain::service
