// What is checked when a job is submitted: its text, and what the disk already tells.
#pragma once

#include <string>
#include <vector>

#include "tools/service/work/job_request.h"

namespace postchain::service {

struct Submission {
    JobKind kind = JobKind::run;
    int priority = 0;
    int frames = 0;  // of a run
    std::vector<std::string> warnings;
};

// Problems: those of JobReader::job(); (invalid) input frames that are missing, no output folder
// without `mkdir`, a kind that another queue does not run (`remote`). Remedies name keys of the
// request.
Answer<Submission> check_submission(const std::string& body, const JobReader& reader, bool remote);

// Of a body {"priority": 5}.
Answer<int> read_priority(const std::string& body, const Roots& roots);

// A message of the command in terms of a request: "--on-existing skip" becomes "on_existing: skip".
std::string in_terms_of_request(std::string message, const ParameterTable& table);

}  // namespace postchain::service
