// Filters a sequence and writes it.
//
//   reader thread          this thread (GL)       writer thread
//   open, read, convert -> plan, filter        -> scan, write, sidecar        per frame
#pragma once

#include <map>
#include <string>
#include <utility>
#include <vector>

#include "chain/gl/executor.h"
#include "chain/pass/chain.h"
#include "tools/sequence/run/runner.h"

namespace postchain::sequence {

// `executor` must belong to the GL context current on this thread. RunCallbacks::stop ends the run
// within a frame. With RunSettings::watch the run waits for frames. A Status that is not ok means
// that nothing could be started: no frames, missing frames under MissingPolicy::error, or outputs
// that run/run_files.h refuses. (Under ErrorPolicy::keep_going existing outputs only fail their own
// frames.) Failures of single frames are in the summary, as with walk_sequence(). A frame fails if
// an input changes before its output is in place.
Result<RunSummary> run_sequence(const Chain& chain, const RunSettings& settings, Executor& executor,
                                const std::string& renderer, const RunCallbacks& callbacks);

// The refusals of run_sequence() before its first frame, without a device and a change on disk.
struct RunCheck {
    std::vector<FrameTask> tasks;
    std::map<int, std::string> refused;  // under ErrorPolicy::keep_going: why, by frame
    std::vector<std::pair<std::string, Status>> faults;  // with the keys of their settings
};
RunCheck check_run(const Chain& chain, const RunSettings& settings);

}  // namespace postchain::sequence
