// Hands each frame of a sequence to a caller while the next ones are read.
#pragma once

#include <atomic>
#include <functional>

#include "tools/sequence/record/frame_report.h"
#include "tools/sequence/settings/run_settings.h"
#include "tools/sequence/source/frame_source.h"

namespace postchain::sequence {

// Called on the caller's thread with each frame in order. An error fails that frame.
using FrameVisitor = std::function<Status(SourceFrame& frame, FrameReport& report)>;

// Reads color and the available planes of `wanted`, of neighbors too. Output settings are ignored.
// A frame counts as written if the visitor succeeds. Errors: those of run_sequence().
Result<RunSummary> visit_sequence(const RunSettings& settings, RoleSet wanted,
                                  const FrameVisitor& visitor, const FrameObserver& observer,
                                  const std::atomic<bool>* stop);

}  // namespace postchain::sequence
