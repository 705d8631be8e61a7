// /openapi.json: OpenAPI 3.1, made from the table of routes.
#pragma once

#include <string>
#include <vector>

#include "tools/sequence/files/json.h"
#include "tools/service/http/route.h"

namespace postchain::service {

// `job_schema`: JSON Schema of a submitted job.
std::string openapi_of(const std::vector<Route>& routes, io::Json job_schema,
                       const std::string& version, bool asks_for_token);

}  // namespace postchain::service
