// Slurm as a queue: sbatch, squeue, sacct, scontrol and scancel of 20.11 or later.
#pragma once

#include <atomic>
#include <map>
#include <string>
#include <vector>

#include "tools/service/work/task_queue.h"

namespace postchain::service {

struct SlurmSettings {
    // Further options of sbatch, such as --partition=farm. "{user}" in them becomes the name of the
    // job's owner.
    std::vector<std::string> words;
    std::string memory;   // of a task, "8G"; empty = the queue's default
    int cpus = 2;         // of a task
    int nice = 10;        // for each step that a priority is below the largest
    std::string version;  // of `postchain`, which a task's program must have; empty = any
};

class SlurmQueue final : public TaskQueue {
  public:
    explicit SlurmQueue(SlurmSettings settings) : settings_(std::move(settings)) {}

    std::string name() const override { return "slurm"; }
    Result<std::string> submit(const TaskArray& job) override;
    Result<std::map<std::string, ArrayState>> look(const std::vector<ArrayName>& jobs) override;
    Status change(const std::string& id, const TaskRank& rank) override;
    Status cancel(const std::string& id) override;
    void stop() override { stop_ = true; }

  private:
    Result<std::string> answer_of(const std::vector<std::string>& words,
                                  const std::string& input = "") const;
    int nice_of(const TaskRank& rank) const;

    const SlurmSettings settings_;
    std::atomic<bool> stop_ = false;
};

// The script of a job's tasks.
std::string script_of(const TaskArray& job, const std::string& version);
// Adds the tasks in the output of `squeue -o %F|%K|%T|%j`, by the jobs' names, or of `sacct -n -X
// -P -o JobID,State,JobName`.
void add_tasks_of_squeue(const std::string& text, std::map<std::string, ArrayState>& jobs);
void add_tasks_of_sacct(const std::string& text, std::map<std::string, ArrayState>& jobs);

}  // namespace postchain::service
