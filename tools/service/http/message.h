// A request and its reply, apart from the library that carries them.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace postchain::service {

using Headers = std::vector<std::pair<std::string, std::string>>;

// Regardless of case, as names of headers are compared.
bool same_word(std::string_view a, std::string_view b);

struct Request {
    std::string method;  // "GET"
    std::string target;  // "/v1/jobs?limit=5", as it came
    Headers headers;
    std::string body;
    bool http_1_0 = false;

    // The first header of that name; null where there is none.
    const std::string* header(std::string_view name) const;
    size_t count(std::string_view name) const;
};

// Events to send for as long as the client listens.
struct EventsWanted {
    std::string job;               // empty: of all jobs
    std::optional<int64_t> after;  // an id; unset: from now on
};

struct Reply {
    int status = 200;
    std::string type = "application/json";
    std::string body;
    Headers headers;  // beside type and length
    std::optional<EventsWanted> events;
};

// Called once, from any thread.
using Respond = std::function<void(Reply)>;

// "/v1/jobs/a%20b?limit=5" in parts, each decoded.
struct Target {
    std::vector<std::string> segments;  // "v1", "jobs", "a b"
    std::map<std::string, std::string> query;
};
// None: no path from the root, a broken escape, a part that is ".", ".." or has a slash, a
// backslash or a control character once it is decoded, a query key given twice.
std::optional<Target> parse_target(std::string_view text);

// "Bad Request" of 400.
const char* reason_of(int status);

}  // namespace postchain::service
