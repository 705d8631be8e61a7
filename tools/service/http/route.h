// The table of routes: paths, methods and replies. Router, Allow, handlers and /openapi.json are
// made from its rows.
#pragma once

#include <charconv>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "tools/service/http/message.h"
#include "tools/service/store/users.h"

namespace postchain::service {

// The name of a user who is not known, at routes that are open. No user of a file has it.
inline constexpr const char* kStranger = "\n";

// A request with its route.
struct Call {
    const Request& request;
    const Target& target;
    std::vector<std::string> values;  // of the path's {names}, in order
    const User& user;

    std::string query(const std::string& name) const;  // empty = not given
};
using Handler = std::function<void(const Call&, const Respond&)>;

struct QueryParameter {
    std::string name;
    std::string description;
    std::vector<std::string> words = {};  // the values it may have; empty = any
    std::string pattern = {};             // instead of words: a regular expression
    struct Range {
        int64_t least, most;
    };
    std::optional<Range> integer = {};  // instead of words
    bool required = false;
};

// The whole text as a number.
template <class T>
std::optional<T> number_of(const std::string& text) {
    T value = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
    return value;
}

struct Route {
    std::string method = "GET";  // HEAD is GET without a body
    std::string path = {};       // "/v1/jobs/{id}"; "{name...}" takes the rest of the path
    std::string operation = {};  // operationId
    std::string summary = {};    // one line for /openapi.json
    Handler handle = {};
    bool open = false;                         // requires no token
    std::vector<QueryParameter> queries = {};  // others are refused
    std::string body = {};                     // name of the body's schema; empty = no body
    bool audited = false;                      // a line of the log for each request
    int status = 200;                          // on success
    std::vector<int> refusals = {};            // statuses besides those that any route has
    std::string type = "application/json";
    std::vector<std::string> other_types = {};  // that a request may ask for
    std::string schema = {};                    // name of the reply's schema; empty = none
    bool streams = false;                       // HEAD is not possible
    bool at_once = false;                       // the reply is immediate and needs no other thread
    bool reads_files = false;                   // may wait for a disk: runs on Shared::disk_pool
};

// A handler that replies at the end of the call.
Handler replies(std::function<Reply(const Call&)> reply);

// A route and the values of its {names}, or a refusal: 400, 404, 405 with Allow.
struct Match {
    const Route* route = nullptr;
    std::vector<std::string> values;
};
// Whether the method of this path requires no token, whatever the query.
bool is_open(const std::vector<Route>& routes, const std::string& method, const Target& target);
std::variant<Match, Reply> find_route(const std::vector<Route>& routes, const std::string& method,
                                      const Target& target);

}  // namespace postchain::service
