// The work on a study by one process, beside others in the same folder.
//
//   for each task without a result: claim it (Claim of files/atomic_file.h), measure it, keep its
//   result
//
// until a round finds nothing to claim. The result does not depend on which process measures a
// task. A process that finds all results writes the report: the last to finish always does.
#pragma once

#include "tools/measure/study/study_folder.h"
#include "tools/sequence/files/sequence.h"

namespace postchain::study {

struct WorkDone {
    size_t tasks = 0;    // of the study
    size_t made = 0;     // by this process
    size_t results = 0;  // that exist
    bool complete() const { return results == tasks; }
};

// `chunk`: the part of the tasks to work on. Failures of an earlier process are tried again, once.
// Errors: those of measure_task(), StudyFolder::result(), Claim::take().
Result<WorkDone> work_on_tasks(const Study& study, const StudyFolder& folder,
                               const io::Chunk& chunk, const Machine& machine,
                               const experiment::ProgressCallback& progress,
                               const std::atomic<bool>* stop);

}  // namespace postchain::study
