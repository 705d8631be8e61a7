// The work on a study by one process, beside others in the same folder.
//
//   for each task without a result: claim it (Claim of files/atomic_file.h), measure it by run_ab()
//   or run_bench(), keep its result
//
// until a round finds nothing to claim. The result does not depend on which process measures a
// task. A process that finds all results writes the report: the last to finish always does.
#pragma once

#include <atomic>
#include <functional>
#include <string>
#include <vector>

#include "chain/egl/context.h"
#include "tools/measure/experiment/experiment.h"
#include "tools/measure/study/study_folder.h"
#include "tools/sequence/files/sequence.h"

namespace postchain::study {

// The device on which tasks are measured.
struct Machine {
    Executor& executor;
    std::string renderer;
    bool software = false;
    std::function<Status()> make_current;  // after ground truth was rendered in another context
    egl::ContextOptions options;
    int threads = 0;  // CPU threads; 0 = one per core
    std::vector<std::string> command;
};

struct WorkDone {
    size_t tasks = 0;    // tasks of the study
    size_t made = 0;     // by this process
    size_t results = 0;  // that exist
    bool complete() const { return results == tasks; }
};

// `chunk`: the part of the tasks to work on. Failures of an earlier process are tried again, once.
// Failures of a scene are in its result. Errors end the work: those of StudyFolder::result() and
// Claim::take(), (output), (gl), (canceled) by `stop`, (internal).
Result<WorkDone> work_on_tasks(const Study& study, const StudyFolder& folder,
                               const io::Chunk& chunk, const Machine& machine,
                               const experiment::ProgressCallback& progress,
                               const std::atomic<bool>* stop);

}  // namespace postchain::study
