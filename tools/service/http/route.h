// Routes: the operations of the interface (a table in route.cpp) with their handlers. Router, Allow
// and /openapi.json are made from them.
#pragma once

#include <functional>
#include <map>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "tools/sequence/files/json.h"
#include "tools/service/http/message.h"
#include "tools/service/store/users.h"

namespace postchain::service {

// The name of a user who is not known, at routes that are open. No user of a file has it.
inline constexpr const char* kStranger = "\n";

struct Route;

// A request with its route.
struct Call {
    const Request& request;
    const Target& target;
    const Route& route;
    std::vector<std::string> values;  // of the path's {names}, in order
    const User& user;

    std::string query(const std::string& name) const;  // empty = not given, and without a default
    template <class T>
    T number(const std::string& name) const;  // of a query that has a default or is required
    int frame() const { return *number_of<int>(values.at(1)); }  // of a path with an {n}
};
using Handler = std::function<void(const Call&, const Respond&)>;

struct Route {
    std::string method = "GET";  // HEAD is GET without a body
    // "/v1/jobs/{id}"; "{n}" takes a number, "{name...}" the rest of the path.
    std::string path = {};
    Handler handle = {};
    io::Json about = {};                    // of the interface
    io::Json queries = io::Json::object();  // JSON Schemas by name; others are refused

    std::string operation() const { return about.value("id", ""); }
    bool has_body() const { return about.contains("body"); }
    bool is(const char* word) const;
};

template <class T>
T Call::number(const std::string& name) const {
    return number_of<T>(query(name)).value_or(T());
}

// A route for each operation. `handlers` has one for each, by its id.
std::vector<Route> routes_of(const std::map<std::string, Handler>& handlers);

// A handler that replies at the end of the call.
Handler replies(std::function<Reply(const Call&)> reply);

// A route and the values of its {names}, or a refusal: 404, 405 with Allow.
struct Match {
    const Route* route = nullptr;
    std::vector<std::string> values;
};
std::variant<Match, Reply> find_route(const std::vector<Route>& routes, const std::string& method,
                                      const Target& target);
// The refusal of the queries of a target (400), or nothing.
std::optional<Reply> refuse_queries(const Route& route, const Target& target);

// /openapi.json: OpenAPI 3.1. `job_schema`: JSON Schema of a submitted job.
std::string openapi_of(const std::vector<Route>& routes, io::Json job_schema,
                       const std::string& version, bool asks_for_token);

}  // namespace postchain::service
