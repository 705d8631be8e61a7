// Runs the frames of a `run` job through run/run_sequence. The store records the beginning and the
// end of every frame, so that any process can resume the job.
#pragma once

#include "tools/sequence/settings/run_settings.h"
#include "tools/service/work/job_work.h"

namespace postchain::service {

inline constexpr size_t kMaxFramesOfJob = 100'000;

// The frames of a job, from the files on disk. `writes` as for plan_tasks(). Errors: those of
// plan_tasks(); (usage) too many.
Result<std::vector<sequence::FrameTask>> tasks_of(const sequence::RunSettings& settings,
                                                  bool writes = true);

// Checks that the folders of a run still are under the roots. Errors (input), (output).
Status check_run_paths(const sequence::RunSettings& settings, const Roots& roots);
// The checks that the command makes before its first frame, and the frames as the store keeps them:
// with `on_error: continue` those whose outputs may not be replaced are quarantined.
Result<std::vector<JobFrame>> begin_frames(const JobRequest& request, const Roots& roots);
// Whether the existing output of a frame is whole and made as the job asks, with or without its
// sidecar and preview.
bool is_own_output(const JobRequest& request, int frame);
// Whether a file was changed after this time, in milliseconds since 1970.
bool made_after(const std::string& path, int64_t ms);
// Size of a frame's image, sidecar and preview, as far as they exist.
int64_t bytes_of_outputs(const std::string& output, const sequence::RunSettings& settings);
// The exit code of a job with frames that failed. `unhealthy`: --strict refused one.
int exit_code_of_frames(int done, const Status& first_failure, bool unhealthy);
// The end of a job whose frames have all ended. Errors (output): the store.
Result<WorkEnd> end_of_frames(const JobStore& store, const std::string& id,
                              const Status& first_failure, bool unhealthy);

// `job` is running. GL is current on this thread.
WorkEnd work_on_frames(const Job& job, JobRequest& request, const WorkContext& context);

}  // namespace postchain::service
