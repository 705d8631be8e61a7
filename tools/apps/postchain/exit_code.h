// How a subcommand ends: its exit code, and what it says of a failure.
#pragma once

#include "chain/status.h"
#include "tools/sequence/record/frame_report.h"

namespace postchain {

using sequence::exit_code;
using sequence::kExitChain;
using sequence::kExitGl;
using sequence::kExitHealth;
using sequence::kExitInput;
using sequence::kExitOk;
using sequence::kExitOutput;
using sequence::kExitSignal;
using sequence::kExitSomeFailed;
using sequence::kExitThreshold;
using sequence::kExitUsage;

// Prints the status as an error, unless it is already printed, and returns its exit code.
int fail(const Status& status);
// Marks a failure whose diagnostics are on stderr, so that fail() does not print it.
Status already_said(const Status& status);

}  // namespace postchain
