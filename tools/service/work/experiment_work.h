// Runs `ab`, `bench` and `study` jobs with the same code as the command.
#pragma once

#include "tools/service/work/job_work.h"

namespace postchain::service {

// Checks that every path of an ab, bench or study is under the roots, with links resolved. Errors
// (input), (output).
Status check_experiment_paths(const JobRequest& request, const Roots& roots);

// The size of a report's folder.
int64_t bytes_of_files(const std::string& folder);

// `job` is running. GL is current on this thread.
WorkEnd work_on_experiment(const Job& job, JobRequest& request, const WorkContext& context);

}  // namespace postchain::service
