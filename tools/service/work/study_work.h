// Runs a `study` job with the same code as the command. Other processes may work on the tasks of
// the same folder.
#pragma once

#include "tools/service/work/job_work.h"

namespace postchain::service {

// `job` is running. GL is current on this thread.
WorkEnd work_on_study(const Job& job, JobRequest& request, const WorkPlace& place);

}  // namespace postchain::service
