// Filters a sequence and writes it.
//
//   reader thread          this thread (GL)       writer thread
//   open, read, convert -> plan, filter        -> scan, write, sidecar        per frame
#pragma once

#include <atomic>
#include <string>

#include "chain/chain.h"
#include "chain/gl/executor.h"
#include "tools/sequence/run/frame_report.h"
#include "tools/sequence/run/frame_task.h"
#include "tools/sequence/run/run_settings.h"

namespace postchain::sequence {

// `executor` must belong to the GL context current on this thread. `stop` (may be null) ends the
// run after the frame under way. A Status that is not ok means that nothing could be started (no
// frames, missing frames under MissingPolicy::error, outputs that run/run_files.h refuses; those
// that exist are a failure of their frames under ErrorPolicy::keep_going); failures of single
// frames are in the summary, as of walk_sequence(). A frame one of whose inputs changes before its
// output is in place fails. With RunSettings::watch it waits for frames, and tells `waits` which.
Result<RunSummary> run_sequence(const Chain& chain, const RunSettings& settings, Executor& executor,
                                const std::string& renderer, const FrameObserver& observer,
                                const std::atomic<bool>* stop, const FrameStart& start = {},
                                const WaitObserver& waits = {});

}  // namespace postchain::sequence
