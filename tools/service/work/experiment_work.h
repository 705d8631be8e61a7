// Runs an `ab` or `bench` job with the same code as the command.
#pragma once

#include "tools/service/work/job_work.h"

namespace postchain::service {

// `job` is running. GL is current on this thread.
WorkEnd work_on_experiment(const Job& job, JobRequest& request, const WorkPlace& place);

// Checks that every path of an experiment is under the roots, with links resolved. Errors (input),
// (output).
Status check_paths(const experiment::ExperimentSettings& settings, const Roots& roots);

}  // namespace postchain::service
