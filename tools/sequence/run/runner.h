// Walks a sequence; the only place that does.
//
//   reader thread                  this thread (GL)        writer thread
//   open, begin, read, prepare  -> process              -> write               per frame
//
// A FrameJob does the steps between the arrows. Neighboring frames overlap; at most kFramesInFlight
// exist at a time, so memory does not grow with the sequence's length. The overlap never changes
// pixels. Neighboring frames share planes (source/sequence_reader.h).
#pragma once

#include <atomic>

#include "tools/sequence/run/frame_feed.h"
#include "tools/sequence/run/frame_job.h"
#include "tools/sequence/settings/run_settings.h"

namespace postchain::sequence {

inline constexpr int kFramesInFlight = 4;  // reading, waiting, processing, writing

// Runs the job on each frame of the feed. `stop` (may be null) ends the walk; the
// frame under way is not written. `waits` is called while the walk can only wait for a frame.
// Failures of single frames are in the summary; under ErrorPolicy::stop every frame before the
// failed one is still finished. Errors (internal): no thread could be started. Throws nothing:
// exceptions of libraries become a Status.
Result<RunSummary> walk_sequence(FrameJob& job, const RunSettings& settings, FrameFeed& feed,
                                 const FrameObserver& observer, const std::atomic<bool>* stop,
                                 const FrameStart& start = {}, const WaitObserver& waits = {},
                                 const StepObserver& steps = {});

}  // namespace postchain::sequence
