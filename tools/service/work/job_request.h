// Requests: text -> settings, with every path checked against the roots.
//
//   JSON --keys of the tables of settings/job_settings.h, and those of a measurement--> JobRequest
//
// The same function reads a job when it is submitted and when it runs, and resolves its paths each
// time.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "chain/base/parameter.h"
#include "chain/pass/pass.h"
#include "tools/sequence/files/json.h"
#include "tools/sequence/settings/job_settings.h"
#include "tools/service/store/job.h"
#include "tools/service/store/users.h"
#include "tools/service/work/problem.h"
#include "tools/service/work/request_chain.h"
#include "tools/service/work/roots.h"

namespace postchain::service {

class Measurement;

enum class RequestKind { run, ab, bench, study, plan, preview };  // the jobs first, as in JobKind

inline constexpr int kMaxFrameTimeoutS = 86'400;

enum class PreviewPlane { color, depth };

struct JobRequest {
    JobKind kind = JobKind::run;
    int priority = 0;
    int frame_timeout_s = 0;                   // 0 = that of the service
    NamedChain chain;                          // of a run, plan and preview
    sequence::RunSettings run;                 // of an ab or bench that of the measurement
    int frame = 0;                             // preview
    double scale = 1;                          // preview: kMinPreviewScale..1
    PreviewPlane plane = PreviewPlane::color;  // preview
    std::shared_ptr<Measurement> measurement;  // null but for ab, bench and study
    std::vector<std::string> warnings;
};

class JobReader {
  public:
    // `registry` and `version` outlive the reader.
    JobReader(const Roots& roots, const PassRegistry& registry, const std::string& version,
              int threads);
    // The largest --max-memory of jobs and of previews, bytes; 0 = none.
    void limit_memory(uint64_t jobs, uint64_t previews) {
        max_memory_ = jobs;
        max_preview_memory_ = previews;
    }
    // The same reader with other folders.
    JobReader with(Roots roots) const;

    // Problems: (invalid), (forbidden), with every fault in `diagnostics`.
    Answer<JobRequest> job(const std::string& body) const;
    Answer<JobRequest> plan(const std::string& body) const;
    Answer<JobRequest> preview(const std::string& body) const;

    const Roots& roots() const { return roots_; }
    // The table of a run's settings.
    const ParameterTable& run_table() const { return *table_; }

  private:
    friend class RequestParser;
    Roots roots_;
    const PassRegistry& registry_;
    const std::string& version_;
    int threads_;
    uint64_t max_memory_ = 0, max_preview_memory_ = 0;
    std::shared_ptr<const ParameterTable> table_;
};

struct ReadJob {
    JobReader reader;
    JobRequest request;
};

// The reader of requests for each user: with the user's own folders.
class Readers {
  public:
    // The arguments outlive this object.
    Readers(const JobReader& all, const Users& users) : all_(all), users_(users) {}

    // Errors (usage): a folder of the user no longer exists.
    Result<JobReader> of(const User& user) const;
    // Errors (usage): as above, or the user is no longer known.
    Result<JobReader> of(const std::string& owner) const;
    // Reads a job again. Errors: as above, or those of its body.
    Result<ReadJob> read(const Job& job) const;
    KnownUser owner_of(const Job& job) const { return users_.named(job.owner); }
    std::string shown_in(const std::string& text) const { return all_.roots().shown_in(text); }

  private:
    const JobReader& all_;
    const Users& users_;
};

// JSON Schema (draft 2020-12) of a job. `run_table`: the settings of a run.
io::Json job_schema(const ParameterTable& run_table);

}  // namespace postchain::service
