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
#include "tools/sequence/run/run_settings.h"

namespace postchain::sequence {

// `executor` must belong to the GL context current on this thread. `stop` (may be null) ends the
// run after the frame under way. A Status that is not ok means that nothing could be started (no
// frames, missing frames under MissingPolicy::error, output equal to input, an output that exists
// under OnExisting::fail with ErrorPolicy::stop); failures of single frames are in the summary, as
// of walk_sequence().
Result<RunSummary> run_sequence(const Chain& chain, const RunSettings& settings, Executor& executor,
                                const std::string& renderer, const FrameObserver& observer,
                                const std::atomic<bool>* stop);

}  // namespace postchain::sequence
