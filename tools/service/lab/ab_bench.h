// `ab` and `bench` jobs, with the same code as the command. The folder's files are a job's own
// after its first start. In another queue: one task, which writes the report.
#pragma once

#include <string>
#include <vector>

#include "tools/measure/experiment/sweep.h"
#include "tools/measure/report/report.h"
#include "tools/metrics/compare.h"
#include "tools/service/lab/measurement.h"

namespace postchain::service {

class AbOrBench final : public Measurement {
  public:
    // As read_measurement().
    AbOrBench(const MeasurementText& text, JobRequest& request);

    const experiment::BenchSettings& settings() const { return measured_; }
    const std::vector<experiment::NamedChain>& variants() const { return variants_; }

    const std::string& report_folder() const override { return measured_.folder; }
    int frames() const override { return frames_of(measured_.run); }
    void limit_memory(uint64_t most) override {
        service::limit_memory(measured_.run.source.max_memory, most);
    }
    Result<bool> needs_new_folder() const override;
    WorkEnd work(const Job& job, const WorkContext& context) override;

    Status begin(const Roots& roots) override;
    Result<TaskCommand> tasks(const Job& job, const RemoteSettings& settings, const Roots& roots,
                              const std::string& folder) override;
    std::optional<TaskProgress> progress(const std::string& folder) const override;
    std::optional<WorkEnd> end(const Job& job, int exit_code, const Roots& roots) const override;

  private:
    void read_variants(const MeasurementText& text);
    void confine_truth(RequestBody& body);
    void read_limits(RequestBody& body);
    void complete(const MeasurementText& text, JobRequest& request);

    Result<WorkEnd> measured(MeasurementRun& run, const WorkContext& context);
    Result<report::Report> bench(MeasurementRun& run, const WorkContext& context,
                                 const io::OutputFiles& files, bool& met);
    WorkEnd end_of(const report::Report& report, bool met) const;

    const bool is_ab_;
    experiment::BenchSettings measured_;      // of ab with its own defaults
    experiment::NamedChain chain_, chain_b_;  // bench has `variants_` of the first
    ChainText text_b_;
    std::vector<experiment::NamedChain> variants_;
    std::vector<metrics::MetricLimit> under_, fail_above_;
};

}  // namespace postchain::service
