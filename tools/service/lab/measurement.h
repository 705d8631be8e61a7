// The common parts of ab, bench and study.
#pragma once

#include <optional>
#include <string>

#include "tools/measure/experiment/experiment.h"
#include "tools/measure/experiment/settings.h"
#include "tools/service/work/job_work.h"
#include "tools/service/work/measurement.h"

namespace postchain::service {

// Checks that every path of an experiment is under the roots, with links resolved. Errors (input),
// (output).
Status check_paths(const experiment::ExperimentSettings& settings, const Roots& roots);

// The frames of a run's input; 0 if there are none, then the job fails when it starts.
int frames_of(const sequence::RunSettings& run);

// The running job: its events, and how it ends if it is stopped or the store fails.
class MeasurementRun {
  public:
    MeasurementRun(const Job& job, const WorkContext& context)
        : id_(job.id), context_(context), events_(context, job.id) {}

    experiment::ProgressCallback progress();
    bool say(const std::string& what) { return events_.say(what, 0, 0); }
    // The end of work that returned this.
    WorkEnd end(const Result<WorkEnd>& worked) const;
    static WorkEnd stopped() { return WorkEnd::of(WorkEnd::How::stopped, ""); }
    static WorkEnd store_failed(const Status& status) {
        return WorkEnd::of(WorkEnd::How::store_failed, status.message());
    }
    const std::string& id() const { return id_; }

  private:
    const std::string id_;
    const WorkContext& context_;
    ProgressEvents events_;
};

// The report.json of a folder, if it was made for the job. No value otherwise.
std::optional<io::Json> report_of(const std::string& folder, const Job& job);

}  // namespace postchain::service
