// Work on an `ab` or `bench` job, as the command does it.
#pragma once

#include "tools/service/work/job_work.h"

namespace postchain::service {

// The job runs. On this thread GL is current.
WorkEnd work_on_experiment(const Job& job, JobRequest& request, const WorkPlace& place);

// Every path of an experiment, under the roots now, links resolved. Errors (input), (output).
Status check_paths(const experiment::ExperimentSettings& settings, const Roots& roots);

}  // namespace postchain::service
