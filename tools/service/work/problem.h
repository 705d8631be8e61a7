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
template <class T>
using Answer = std::variant<T, Problem>;

Problem not_found(const std::string& detail);

// An error of a request's work: without paths outside the roots.
Problem problem_of(const Status& status, const Roots& roots);

// `detail` is the first error of `diagnostics` and the number of further ones.
Problem refusal(Problem::Kind kind, Diagnostics diagnostics);

}  // namespace postchain::service
