// Runs `ab`, `bench` and `study` jobs with the same code as the command.
#pragma once

#include "tools/service/work/job_work.h"

namespace postchain::service {

// `job` is running. GL is current on this thread.
WorkEnd work_on_experiment(const Job& job, JobRequest& request, const WorkContext& context);

}  // namespace postchain::service
