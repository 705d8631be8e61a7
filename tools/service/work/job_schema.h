// The body of a job as JSON Schema, made from the tables that read it.
#pragma once

#include <string>

#include "tools/service/work/job_request.h"

namespace postchain::service {

// JSON Schema (draft 2020-12), indented.
std::string job_schema_text(const JobReader& reader);

}  // namespace postchain::service
