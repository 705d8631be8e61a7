// Slurm as a queue: sbatch, squeue, scontrol, sacct and scancel of 20.11 or later.
#pragma once

#include <chrono>
#include <string>
#include <vector>

#include "tools/service/work/remote_queue.h"

namespace postchain::service {

class SlurmQueue final : public RemoteQueue {
  public:
    // `words`: further options of sbatch, such as --partition=farm.
    explicit SlurmQueue(std::vector<std::string> words) : words_(std::move(words)) {}

    std::string name() const override { return "slurm"; }
    Result<std::string> submit(const RemoteJob& job) override;
    Result<std::string> find(const std::string& name) override;
    Result<RemoteTasks> look(const std::string& id) override;
    Status cancel(const std::string& id) override;

  private:
    const std::vector<std::string> words_;
};

// The tasks in the output of `scontrol show job -o`, or of `sacct -n -X -P -o JobID,State`.
RemoteTasks tasks_of_scontrol(const std::string& text);
RemoteTasks tasks_of_sacct(const std::string& text);

struct ProgramResult {
    int exit_code = 0;
    std::string out, err;
};
// Runs a program and reads what it prints. Errors (output): it cannot be started, or it was killed
// because it took longer than `limit`.
Result<ProgramResult> run_program(const std::vector<std::string>& words, const std::string& input,
                                  std::chrono::milliseconds limit);

// For a shell: 'it'\''s'.
std::string shell_quoted(const std::string& word);

}  // namespace postchain::service
