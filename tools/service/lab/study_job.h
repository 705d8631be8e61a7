// `study` jobs, with the same code as the command. In another queue: an array, whose tasks share
// the measurements (--chunk), and a task after all of them, which writes the report. No two tasks
// need the same lock.
#pragma once

#include <string>

#include "tools/measure/study/study_reader.h"
#include "tools/service/lab/measurement.h"

namespace postchain::service {

class StudyJob final : public Measurement {
  public:
    // As read_measurement().
    explicit StudyJob(const MeasurementText& request);

    const study::Study& study() const { return study_; }

    const std::string& report_folder() const override { return settings_.folder; }
    int frames() const override;
    void limit_memory(uint64_t most) override;
    // Several jobs and commands may work on a study.
    Result<bool> needs_new_folder() const override { return false; }
    WorkEnd work(const Job& job, const WorkContext& context) override;

    std::string fault_of_queue() const override;
    Status begin(const Roots& roots) override;
    Result<TaskCommand> tasks(const Job& job, const RemoteSettings& settings, const Roots& roots,
                              const std::string& folder) override;
    std::optional<TaskProgress> progress(const std::string& folder) const override;
    std::optional<WorkEnd> end(const Job& job, int exit_code, const Roots& roots) const override;

  private:
    Status check_scenes(const Roots& roots) const;
    Result<WorkEnd> work_on_tasks(MeasurementRun& run, const WorkContext& context);

    study::Study study_;  // has its own chains, inputs and settings
    std::string file_;    // resolved; empty: it is an object in the body
    study::StudySettings settings_;
};

}  // namespace postchain::service
