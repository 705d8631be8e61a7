// Requests and replies, independent of sockets. Errors are application/problem+json (RFC 9457).
#pragma once

#include <atomic>
#include <charconv>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "chain/base/readable_file.h"
#include "chain/base/status.h"
#include "chain/base/text.h"
#include "tools/service/work/service.h"

namespace postchain::service {

using Headers = std::vector<std::pair<std::string, std::string>>;
inline constexpr const char* kPolicy = "Content-Security-Policy";

// Case-insensitive, for header names.
inline bool same_word(std::string_view a, std::string_view b) {
    return lower_case(a) == lower_case(b);
}

// The whole text as a number.
template <class T>
std::optional<T> number_of(std::string_view text) {
    T value = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
    return value;
}

// The parts of a text between separators: one more than there are separators.
std::vector<std::string> parts_of(std::string_view text, char separator);

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

struct FilePart {
    uint64_t begin = 0, end = 0;  // bytes
};

// A body that is read from a file while it is sent, its parts one after another.
class FileBody {
  public:
    FileBody(const ResultFile& file, std::vector<FilePart> parts);
    uint64_t bytes() const { return bytes_; }  // in all
    // The next bytes; none at the end. Called on any thread, one call at a time. Errors (input):
    // the file has become shorter.
    Result<std::string> next();

  private:
    const std::string name_;
    std::vector<FilePart> parts_;  // that are left
    size_t at_ = 0;
    uint64_t bytes_ = 0;
    const ReadableFile file_;
};

struct Reply {
    int status = 200;
    std::string type = "application/json";
    std::string body;
    Headers headers;  // in addition to type and length
    std::optional<EventsWanted> events;
    std::shared_ptr<FileBody> file;  // in place of `body`
};

// Called once, from any thread.
using Respond = std::function<void(Reply)>;

Reply file_reply(const ResultFile& file);
Reply parts_reply(const ResultFile& file, std::vector<FilePart> parts);
Reply download_reply(const ResultFile& file);  // with the file's name

// {"type": "about:blank", "title", "status", "detail"}. `detail` must not contain local paths.
// `retry_after_s`: seconds in Retry-After; 0 = without it.
Reply problem(int status, const std::string& detail, int retry_after_s = 0);
// With the diagnostics as "errors", and Retry-After for busy and unavailable.
Reply problem(const Problem& what);

// Adds "request_id" to a problem; other replies stay.
void name_request(Reply& reply, const std::string& id);

// The decoded parts of "/v1/jobs/a%20b?limit=5".
struct Target {
    std::vector<std::string> segments;  // "v1", "jobs", "a b"
    std::map<std::string, std::string> query;
};
// Nothing if the path is not absolute, an escape is invalid, a decoded part is "." or ".." or
// contains a slash, backslash or control character, or a query key is repeated.
std::optional<Target> parse_target(std::string_view text);

// "Bad Request" for 400.
std::string reason_of(int status);

}  // namespace postchain::service
