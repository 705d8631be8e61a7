// Requests and replies, independent of the HTTP library.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "chain/base/status.h"

namespace postchain::service {

using Headers = std::vector<std::pair<std::string, std::string>>;
inline constexpr const char* kPolicy = "Content-Security-Policy";

// Case-insensitive, for header names.
bool same_word(std::string_view a, std::string_view b);

struct Request {
    std::string method;  // "GET"
    std::string target;  // "/v1/jobs?limit=5", as received
    Headers headers;
    std::string body;
    bool http_1_0 = false;
    std::string peer;                              // the address that the connection comes from
    std::string id = {};                           // in its reply and the log
    std::string share = {};                        // whose turn the request takes: HelperThreads
    std::shared_ptr<std::atomic<bool>> left = {};  // set: the client has left

    // The first header of that name, or null.
    const std::string* header(std::string_view name) const;
    size_t count(std::string_view name) const;
};

// Events to send while the client listens.
struct EventsWanted {
    std::string job;               // empty: of all jobs
    std::optional<int64_t> after;  // an id; unset: from now on
};

// A body that is read while it is sent.
class BodySource {
  public:
    virtual ~BodySource() = default;
    virtual uint64_t bytes() const = 0;  // in all
    // The next part; empty at the end. Called on any thread, one call at a time. An error ends the
    // connection.
    virtual Result<std::string> next() = 0;
};

struct Reply {
    int status = 200;
    std::string type = "application/json";
    std::string body;
    Headers headers;  // in addition to type and length
    std::optional<EventsWanted> events;
    std::shared_ptr<BodySource> source;  // in place of `body`
};

// Called once, from any thread.
using Respond = std::function<void(Reply)>;

// The decoded parts of "/v1/jobs/a%20b?limit=5".
struct Target {
    std::vector<std::string> segments;  // "v1", "jobs", "a b"
    std::map<std::string, std::string> query;
};
// Nothing if the path is not absolute, an escape is invalid, a decoded part is "." or ".." or
// contains a slash, backslash or control character, or a query key is repeated.
std::optional<Target> parse_target(std::string_view text);

// "Bad Request" for 400.
const char* reason_of(int status);

}  // namespace postchain::service
