// Jobs: submission, list, changes.
#pragma once

#include <vector>

#include "tools/service/http/route.h"
#include "tools/service/work/service.h"

namespace postchain::service {

void add_job_routes(std::vector<Route>& routes, Service& service);

}  // namespace postchain::service
