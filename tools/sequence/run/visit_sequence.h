// Shows each frame of a sequence to a caller, while the next ones are being read.
#pragma once

#include <atomic>
#include <functional>

#include "tools/sequence/run/frame_report.h"
#include "tools/sequence/run/frame_source.h"
#include "tools/sequence/run/run_settings.h"

namespace postchain::sequence {

// Called on the caller's thread with each frame in order. A failure is that frame's.
using FrameVisitor = std::function<Status(SourceFrame& frame, FrameReport& report)>;

// Reads color and those of `wanted` that there are, of neighbors too. Whatever settings say about
// output is not looked at. A frame that the visitor took well counts as written. Errors: as of
// run_sequence().
Result<RunSummary> visit_sequence(const RunSettings& settings, RoleSet wanted,
                                  const FrameVisitor& visitor, const FrameObserver& observer,
                                  const std::atomic<bool>* stop);

}  // namespace postchain::sequence
