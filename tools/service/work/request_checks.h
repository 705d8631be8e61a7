// Requests that are answered without work: a submitted job is checked (its text, its inputs and its
// output folder), a request is planned, faults in a chain's text are listed.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "tools/service/store/job.h"
#include "tools/service/work/job_request.h"
#include "tools/service/work/service.h"

namespace postchain::service {

struct Submission {
    JobKind kind = JobKind::run;
    int priority = 0;
    int frames = 0;  // of a run
    std::vector<std::string> warnings;
    std::string output = {};        // the pattern or folder that it writes; empty: others may, too
    std::vector<int> written = {};  // frames of a run whose outputs must not exist
    std::string about = {};         // Job::about
    std::string writes = {};        // NewJob::writes
};

// Problems: those of JobReader::job(); (invalid) input frames are missing, there is no output
// folder and no `mkdir`, outputs exist under `on_existing: fail` (at that key), or another queue
// (`remote`) does not run this kind or write stages. Remedies name keys of the request.
Answer<Submission> check_submission(const std::string& body, const JobReader& reader, bool remote);

// The refusal of a job whose output `other` is going to write, or nothing. `other`: an unfinished
// job with the same Submission::output.
std::optional<Problem> same_output(const std::string& body, const Submission& job, const Job& other,
                                   const JobReader& reader);

// The priority in a body {"priority": 5}.
Answer<int> read_priority(const std::string& body, const Roots& roots);

// JSON, as `postchain plan --json`: of one frame, or of those that the request names.
Answer<std::string> plan_of(const std::string& body, const JobReader& reader);

// `body`: {"text": ...}.
Answer<CheckedChain> check_chain_text(const std::string& body, const PassRegistry& registry);

}  // namespace postchain::service
