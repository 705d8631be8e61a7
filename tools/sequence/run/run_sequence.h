// Filters a sequence and writes it.
//
//   reader thread          this thread (GL)       writer thread
//   open, read, convert -> plan, filter        -> scan, write, sidecar        per frame
#pragma once

#include <atomic>
#include <string>

#include "chain/gl/executor.h"
#include "chain/pass/chain.h"
#include "tools/sequence/record/frame_report.h"
#include "tools/sequence/settings/run_settings.h"

namespace postchain::sequence {

// `executor` must belong to the GL context current on this thread. `stop` (may be null) ends the
// run within a frame, which is not written. With RunSettings::watch the run waits for frames and
// reports them to `waits`. A Status that is not ok means that nothing could be started: no frames,
// missing frames under MissingPolicy::error, or outputs that run/run_files.h refuses. (Under
// ErrorPolicy::keep_going existing outputs only fail their own frames.) Failures of single frames
// are in the summary, as with walk_sequence(). A frame fails if an input changes before its output
// is in place.
Result<RunSummary> run_sequence(const Chain& chain, const RunSettings& settings, Executor& executor,
                                const std::string& renderer, const FrameObserver& observer,
                                const std::atomic<bool>* stop, const FrameStart& start = {},
                                const WaitObserver& waits = {}, const StepObserver& steps = {});

}  // namespace postchain::sequence
