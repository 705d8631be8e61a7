// Exit codes of the command and of service jobs (listed in docs/command.md).
#pragma once

#include "chain/status.h"
#include "tools/sequence/record/frame_report.h"

namespace postchain {

inline constexpr int kExitOk = 0;
inline constexpr int kExitSomeFailed = 1;  // some frames failed
inline constexpr int kExitUsage = 2;
inline constexpr int kExitChain = 3;
inline constexpr int kExitInput = 4;
inline constexpr int kExitOutput = 5;
inline constexpr int kExitGl = 6;
inline constexpr int kExitHealth = 7;
inline constexpr int kExitThreshold = 8;  // an error metric exceeds --fail-above
inline constexpr int kExitSignal = 128;   // plus the signal's number

int exit_code(const Status& status);
// The exit code if `good` other frames succeeded.
int exit_code(const Status& first_failure, size_t good);
int exit_code(const sequence::RunSummary& summary);

}  // namespace postchain
