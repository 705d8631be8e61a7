// The routes over a Service: from a request to its reply, without sockets.
//
//   header --admit()--> Match or refusal --body--> run() --> Reply
#pragma once

#include <memory>
#include <string>
#include <variant>
#include <vector>

#include "tools/service/http/guard.h"
#include "tools/service/http/message.h"
#include "tools/service/http/route.h"
#include "tools/service/work/service.h"

namespace postchain::service {

struct Admitted {
    Target target;
    Match match;
    // It waits for no thread: its answer is at hand.
    bool at_once = false;
};

class Api {
  public:
    // `service` outlives this. `more_metrics`: Prometheus text that follows the service's own.
    Api(Service& service, const GuardSettings& guard, std::string version,
        std::function<std::string()> more_metrics);

    // By the header alone, so that no body is read for what is refused.
    std::variant<Admitted, Reply> admit(const Request& header) const;
    // `request` with its body. Answers once, from this or another thread.
    void run(const Admitted& admitted, const Request& request, const Respond& respond) const;

    const std::vector<Route>& routes() const { return routes_; }
    const Guard& guard() const { return guard_; }

  private:
    void add_jobs();
    void add_results();
    void add_tools();
    void add_about();
    void add_page();

    Service& service_;
    Guard guard_;
    std::string version_;
    std::function<std::string()> more_metrics_;
    std::vector<Route> routes_;
};

// What every reply has beside its own: nosniff, no-referrer, who may frame it, what may run in it.
Headers security_headers(const Reply& reply);

}  // namespace postchain::service
