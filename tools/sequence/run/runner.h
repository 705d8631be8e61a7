// The runner: the one place that walks a sequence.
//
//   reader thread                  this thread (GL)        writer thread
//   open, begin, read, prepare  -> process              -> write               per frame
//
// What stands between the arrows is a FrameJob's. Neighboring frames overlap; at most
// kFramesInFlight are alive, so memory does not grow with the length of the sequence, and the
// pixels never depend on the overlap. The planes of neighbors are shared with them
// (run/sequence_reader.h).
#pragma once

#include <atomic>

#include "tools/sequence/run/frame_feed.h"
#include "tools/sequence/run/frame_job.h"
#include "tools/sequence/run/run_settings.h"

namespace postchain::sequence {

inline constexpr int kFramesInFlight = 4;  // reading, waiting, processing, writing

// Does the job with each frame of the feed. `stop` (may be null) ends the walk after the frame
// under way. `waits` is called while there is nothing to do but to wait for a frame. Failures of
// single frames are in the summary; under ErrorPolicy::stop every frame before the failed one is
// still finished. Errors (internal): no thread could be started. Nothing is thrown: what a library
// throws becomes a Status.
Result<RunSummary> walk_sequence(FrameJob& job, const RunSettings& settings, FrameFeed& feed,
                                 const FrameObserver& observer, const std::atomic<bool>* stop,
                                 const FrameStart& start = {}, const WaitObserver& waits = {});

}  // namespace postchain::sequence
