// Runs a program and reads what it prints.
#pragma once

#include <chrono>
#include <string>
#include <vector>

#include "chain/base/status.h"

namespace postchain::service {

struct ProgramResult {
    int exit_code = 0;
    std::string out, err;
};
// Errors (output): it cannot be started, or it was killed because it took longer than `limit`.
Result<ProgramResult> run_program(const std::vector<std::string>& words, const std::string& input,
                                  std::chrono::milliseconds limit);

// For a shell: 'it'\''s'.
std::string shell_quoted(const std::string& word);

}  // namespace postchain::service
