// Work on a `study` job, as the command does it: its units lie in its folder, where other processes
// may work on them too.
#pragma once

#include "tools/service/work/job_work.h"

namespace postchain::service {

// The job runs. On this thread GL is current.
WorkEnd work_on_study(const Job& job, JobRequest& request, const WorkPlace& place);

}  // namespace postchain::service
