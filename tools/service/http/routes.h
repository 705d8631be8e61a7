// The addresses of a Service, without sockets: jobs, their results, work without a job, the service
// itself.
//
//   header --admit()--> Match or refusal --body--> run() --> Reply
#pragma once

#include <chrono>
#include <functional>
#include <string>
#include <variant>
#include <vector>

#include "tools/service/http/guard.h"
#include "tools/service/http/route.h"
#include "tools/service/work/service.h"

namespace postchain::service {

struct Admitted {
    Target target;
    Match match;
    Sender sender;  // without a user at open routes
};

// What the threads that run requests say of themselves. Called on any thread.
struct RequestThreads {
    std::function<size_t()> hanging;
    std::function<bool()> alive;  // some still take requests
    // How long requests have waited because every thread computes.
    std::function<std::chrono::milliseconds()> stalled;
    std::function<std::string()> metrics;  // Prometheus text after the service's own
};

class Api {
  public:
    // `service` outlives this object.
    Api(Service& service, const GuardSettings& guard, const std::string& version,
        const RequestThreads& threads);

    // Decides by the header alone, so that no body of a refused request is read.
    std::variant<Admitted, Reply> admit(const Request& header) const;
    // `request` includes its body. Responds once, on this or another thread.
    void run(const Admitted& admitted, const Request& request, const Respond& respond) const;

    const Guard& guard() const { return guard_; }

  private:
    Guard guard_;
    std::vector<Route> routes_;  // refer to this object, which stays in its place
};

}  // namespace postchain::service
