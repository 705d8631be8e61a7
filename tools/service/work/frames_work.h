// Runs the frames of a `run` job through run/run_sequence. The store records the beginning and the
// end of every frame, so that any process can resume the job.
#pragma once

#include "tools/service/work/job_work.h"

namespace postchain::service {

// `job` is running. GL is current on this thread.
WorkEnd work_on_frames(const Job& job, JobRequest& request, const WorkPlace& place);

}  // namespace postchain::service
