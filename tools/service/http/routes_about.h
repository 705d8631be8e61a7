// The service itself: its page, session, schemas, health and counters.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "tools/service/http/guard.h"
#include "tools/service/http/route.h"
#include "tools/service/work/service.h"

namespace postchain::service {

// The last of all: /openapi.json describes the routes before it. The references outlive `routes`,
// which stays in its place.
void add_about_routes(std::vector<Route>& routes, Service& service, const Guard& guard,
                      const std::string& version, std::function<std::string()> more_metrics);

}  // namespace postchain::service
