// Checks a job when it is submitted: its text, its inputs and its output folder.
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

// Problems: those of JobReader::job(); (invalid) input frames are missing, there is no output
// folder and no `mkdir`, or another queue (`remote`) does not run this kind or write stages.
// Remedies name keys of the request.
Answer<Submission> check_submission(const std::string& body, const JobReader& reader, bool remote);

// The priority in a body {"priority": 5}.
Answer<int> read_priority(const std::string& body, const Roots& roots);

// A message of the command in terms of a request: "--on-existing skip" becomes "on_existing: skip".
std::string in_terms_of_request(std::string message, const ParameterTable& table);

}  // namespace postchain::service
