// The addresses of a Service: jobs, their results, work without a job, the service itself.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "tools/service/http/guard.h"
#include "tools/service/http/route.h"
#include "tools/service/work/service.h"

namespace postchain::service {

// The references outlive `routes`, which stays in its place.
void add_routes(std::vector<Route>& routes, Service& service, const Guard& guard,
                const std::string& version, std::function<std::string()> more_metrics);

}  // namespace postchain::service
