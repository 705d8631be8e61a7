// Requests that are answered without work: a submitted job is checked, by itself and against the
// jobs before it; faults in a chain's text are listed.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "chain/pass/pass.h"
#include "tools/service/store/job_store.h"
#include "tools/service/work/job_request.h"
#include "tools/service/work/programs.h"
#include "tools/service/work/service.h"

namespace postchain::service {

struct Submission {
    NewJob job;  // without its key
    std::vector<std::string> warnings;
    std::vector<int> written = {};  // frames of a run whose outputs must not exist
};

// Problems: those of JobReader::job() and Programs::check().
Answer<Submission> check_submission(const std::string& body, const JobReader& reader,
                                    const Programs& programs);

// The refusal of a job whose output `other` is going to write, or nothing. `other`: an unfinished
// job with the same NewJob::output.
std::optional<Problem> same_output(const std::string& body, const Submission& job, const Job& other,
                                   const Roots& roots);

// The priority in a body {"priority": 5}.
Answer<int> read_priority(const std::string& body, const Roots& roots);

// `body`: {"text": ...}.
Answer<CheckedChain> check_chain_text(const std::string& body, const PassRegistry& registry);

}  // namespace postchain::service
