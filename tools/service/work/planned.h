// Answers without a job: the plan of a request, and the faults of a chain's text.
#pragma once

#include <string>

#include "tools/service/work/job_request.h"

namespace postchain::service {

// JSON, as `postchain plan --json`: of one frame, or of those that the request names.
Answer<std::string> plan_of(const std::string& body, const JobReader& reader);

// `body`: {"text": ...}.
Answer<Diagnostics> chain_faults(const std::string& body, const PassRegistry& registry);

}  // namespace postchain::service
