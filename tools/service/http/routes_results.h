// The results of jobs: frames, events, images, reports, outputs.
#pragma once

#include <vector>

#include "tools/service/http/route.h"
#include "tools/service/work/service.h"

namespace postchain::service {

void add_result_routes(std::vector<Route>& routes, Service& service);

}  // namespace postchain::service
