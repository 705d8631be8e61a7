// Work on the frames of a `run` job, through run/run_sequence. Every frame is entered in the store
// before and after it is worked on, so that any process can go on.
#pragma once

#include "tools/service/work/job_work.h"

namespace postchain::service {

// The job runs. On this thread GL is current.
WorkEnd work_on_frames(const Job& job, JobRequest& request, const WorkPlace& place);

}  // namespace postchain::service
