// Replies and values of requests that several resources need.
#pragma once

#include <charconv>
#include <functional>
#include <optional>
#include <string>

#include "tools/sequence/files/json.h"
#include "tools/service/http/job_json.h"
#include "tools/service/http/message.h"
#include "tools/service/http/problem.h"
#include "tools/service/http/route.h"
#include "tools/service/work/service.h"

namespace postchain::service {

inline constexpr const char* kPolicy = "Content-Security-Policy";
// The name of a user who is not known, at routes that are open. No user of a file has it.
inline constexpr const char* kStranger = "\n";

Reply json_reply(int status, const std::string& text);
// Reads the queries `type` and `side` of an image.
ImageWanted image_wanted(const Call& call);
std::vector<QueryParameter> image_queries();
std::function<void(Answer<Picture>)> image_to(const Respond& respond);

// The reply to an answer: its problem, or what `made` returns for its value.
template <class T, class Made>
Reply reply_to(const Answer<T>& answer, const Made& made) {
    if (const auto* wrong = std::get_if<Problem>(&answer)) return problem(*wrong);
    return made(std::get<T>(answer));
}
Reply job_reply(int status, const Answer<Job>& answer);

template <class T>
std::optional<T> number_of(const std::string& text) {
    T value = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
    return value;
}

}  // namespace postchain::service
