// Work on an `ab` or `bench` job, as the command does it.
#pragma once

#include "tools/service/work/job_work.h"

namespace postchain::service {

// The job runs. On this thread GL is current.
WorkEnd work_on_experiment(const Job& job, JobRequest& request, const WorkPlace& place);

}  // namespace postchain::service
