// What a request asks for: text -> settings, with every path held under the roots.
//
//   JSON --keys of the tables of run/job_settings.h and experiment/settings.h--> JobRequest
//
// The same function reads a job when it is submitted and when it is worked on: paths are looked up
// anew each time.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "chain/pass.h"
#include "config/chain_find.h"
#include "tools/measure/experiment/ab.h"
#include "tools/measure/experiment/settings.h"
#include "tools/measure/experiment/sweep.h"
#include "tools/measure/report/limits.h"
#include "tools/measure/study/settings.h"
#include "tools/measure/study/study_reader.h"
#include "tools/sequence/run/job_settings.h"
#include "tools/service/store/job.h"
#include "tools/service/work/held_paths.h"
#include "tools/service/work/json_body.h"
#include "tools/service/work/problem.h"
#include "tools/service/work/roots.h"

namespace postchain::service {

// Which keys a body may have.
enum class RequestKind { run, ab, bench, study, plan, preview };

struct JobRequest {
    JobKind kind = JobKind::run;
    int priority = 0;
    ChainText text;                  // of the first chain, for the sweeps of a bench
    experiment::NamedChain chain;    // with `set`
    experiment::NamedChain chain_b;  // of ab
    std::vector<std::string> sets;
    sequence::RunSettings run;  // of every kind
    std::string input;          // as typed
    experiment::ExperimentSettings ab;
    experiment::BenchSettings bench;
    std::vector<experiment::BenchVariant> variants;  // of bench
    std::vector<report::MetricLimit> under, fail_above;
    study::Study study;  // of study, which has its own chains, inputs and settings
    study::StudySettings study_settings;
    int frame = 0;     // of a preview
    double scale = 1;  // of a preview
};

class JobReader {
  public:
    // All of them outlive the reader.
    JobReader(const Roots& roots, const PassRegistry& registry, const std::string& version,
              int threads);

    // A job. Problems: (invalid), (forbidden); every fault that was found is in `diagnostics`.
    Answer<JobRequest> job(const std::string& body) const;
    // The bodies of plan and preview.
    Answer<JobRequest> plan(const std::string& body) const;
    Answer<JobRequest> preview(const std::string& body) const;

    const Roots& roots() const { return roots_; }
    // The table of a run's settings, over this registry.
    const ParameterTable& run_table() const { return table_; }

  private:
    friend class RequestParser;
    const Roots& roots_;
    const PassRegistry& registry_;
    const std::string& version_;
    const int threads_;
    ParameterTable table_;
};

}  // namespace postchain::service
