// Why the service refuses a request. http/ turns it into problem+json.
#pragma once

#include <string>
#include <variant>

#include "chain/base/status.h"
#include "config/diagnostic.h"
#include "tools/service/work/roots.h"

namespace postchain::service {

inline constexpr int kRetryAfterS = 30;

struct Problem {
    enum class Kind {
        invalid,      // 422: not a valid job, plan or chain; `diagnostics` lists every fault
        not_found,    // 404: unknown job, report or frame
        conflict,     // 409: the job's state does not allow it, or the key belongs to another job
        forbidden,    // 403: a path outside the roots
        busy,         // 429: the queue is full; see `retry_after_s`
        unavailable,  // 503: draining, no GL device, or a store that cannot be written
        internal,     // 500
    };
    Kind kind = Kind::internal;
    std::string detail = {};       // one sentence, with the remedy; no path outside the roots
    Diagnostics diagnostics = {};  // file, line, column, path and message, as the command prints
    int retry_after_s = 0;
};
// A value, or why there is none: a Result for ASSIGN_OR_RETURN.
template <class T>
class Answer : public std::variant<T, Problem> {
  public:
    using std::variant<T, Problem>::variant;
    bool ok() const { return this->index() == 0; }
    T& operator*() { return std::get<0>(*this); }
    const T& operator*() const { return std::get<0>(*this); }
    const T* operator->() const { return &**this; }
    const Problem& status() const { return std::get<1>(*this); }
};

inline Problem not_found(const std::string& detail) {
    return {Problem::Kind::not_found, detail};
}

// An error of a request's work: without paths outside the roots.
inline Problem problem_of(const Status& status, const Roots& roots) {
    const bool gl = status.code() == StatusCode::gl;
    const bool internal = status.code() == StatusCode::internal;
    return {gl         ? Problem::Kind::unavailable
            : internal ? Problem::Kind::internal
                       : Problem::Kind::invalid,
            roots.shown_in(status.message()),
            {},
            gl ? kRetryAfterS : 0};
}

}  // namespace postchain::service
