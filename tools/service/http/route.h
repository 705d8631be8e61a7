// What can be asked, as a table: paths, methods, what they answer. The router, Allow, the handlers
// and /openapi.json come from its rows.
#pragma once

#include <functional>
#include <string>
#include <variant>
#include <vector>

#include "tools/service/http/message.h"

namespace postchain::service {

// A request that has found its route.
struct Call {
    const Request& request;
    const Target& target;
    std::vector<std::string> values;  // of the path's {names}, in order
};
using Handler = std::function<void(const Call&, const Respond&)>;

struct QueryParameter {
    std::string name;
    std::string description;
};

struct Route {
    std::string method = {};   // HEAD is GET without a body
    std::string path = {};     // "/v1/jobs/{id}"; "{name...}" takes all that is left
    std::string summary = {};  // one line, of /openapi.json
    Handler handle = {};
    bool open = false;                         // asks for no token
    std::vector<QueryParameter> queries = {};  // others are refused
    std::string body = {};                     // name of its schema; empty: it takes none
    int status = 200;                          // of success
    std::string type = "application/json";
    std::string schema = {};  // name of the reply's schema; empty: none
};

// A route and the values of its {names}; or why there is none: 400, 404, 405 with Allow.
struct Match {
    const Route* route = nullptr;
    std::vector<std::string> values;
};
std::variant<Match, Reply> find_route(const std::vector<Route>& routes, const std::string& method,
                                      const Target& target);

}  // namespace postchain::service
