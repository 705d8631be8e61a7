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
    // The reply is immediate and needs no other thread.
    bool at_once = false;
};

class Api {
  public:
    // `service` outlives this object. `more_metrics`: Prometheus text after the service's own.
    Api(Service& service, const GuardSettings& guard, std::string version,
        std::function<std::string()> more_metrics);

    // Decides by the header alone, so that no body of a refused request is read.
    std::variant<Admitted, Reply> admit(const Request& header) const;
    // `request` includes its body. Responds once, on this or another thread.
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

// Headers of every reply: nosniff, no-referrer, and a policy for frames and scripts.
Headers security_headers(const Reply& reply);

}  // namespace postchain::service
