// /openapi.json: OpenAPI 3.1 of a table of routes.
#pragma once

#include <string>
#include <vector>

#include "tools/service/http/route.h"

namespace postchain::service {

// `job_schema`: JSON Schema of a job as it is submitted, text.
std::string openapi_of(const std::vector<Route>& routes, const std::string& job_schema,
                       const std::string& version, bool asks_for_token);

}  // namespace postchain::service
