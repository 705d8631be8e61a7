// `ab`, `bench` and `study` in another queue: the commands of their tasks, and how they ended.
//
//   ab, bench   one task, which writes the report
//   study       an array, whose tasks share the measurements (--chunk), and a task after all of
//   them,
//               which writes the report. No two tasks need the same lock.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "tools/service/work/job_work.h"
#include "tools/service/work/remote_queue.h"

namespace postchain::service {

// An array of Slurm has at most 1000 tasks unless MaxArraySize is raised.
inline constexpr size_t kMaxTasks = 1000;

struct ExperimentTasks {
    std::vector<std::string> command;
    std::vector<std::vector<std::string>> words;  // of each task
};

// Writes a file that tasks read. Errors (output).
Status write_task_file(const std::string& path, const std::string& text);

// Before the first task: checks paths and the folder of the report, as on one machine. Errors: as
// there.
Status begin_experiment(JobRequest& request, const Roots& roots);
// Writes the chains to `folder`. Tasks start in the first root. Errors (output).
Result<ExperimentTasks> experiment_tasks(const Job& job, const JobRequest& request,
                                         const RemoteSettings& settings, const Roots& roots,
                                         const std::string& folder);
// How far a job's tasks are, by their messages (ab, bench) or their results (study). No value if
// that is not known yet. `folder`: of the messages.
struct TaskProgress {
    std::string what;
    size_t done = 0, total = 0;
    bool operator==(const TaskProgress&) const = default;
};
std::optional<TaskProgress> progress_of_experiment(const Job& job, const JobRequest& request,
                                                   const std::string& folder);
// The end of a job whose last task has ended with this code. No value if its report is not there.
std::optional<WorkEnd> end_of_experiment(const Job& job, const JobRequest& request, int exit_code,
                                         const Roots& roots);

}  // namespace postchain::service
