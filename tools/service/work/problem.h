// Why something that was asked of the service is not done; http/ makes problem+json of it.
#pragma once

#include <string>
#include <variant>

#include "chain/status.h"
#include "config/diagnostic.h"

namespace postchain::service {

struct Problem {
    enum class Kind {
        invalid,      // 422: the text is no job, plan or chain; `diagnostics` has every fault
        not_found,    // 404: no such job, report or frame
        conflict,     // 409: the job's state does not allow it, or the key is another job's
        forbidden,    // 403: a path outside the roots
        busy,         // 429: the queue is full; `retry_after_s`
        unavailable,  // 503: draining, no GL, or a store that cannot be written
        internal,     // 500
    };
    Kind kind = Kind::internal;
    std::string detail;       // one sentence, with the remedy; no path outside the roots
    Diagnostics diagnostics;  // file, line, column, path, message: as the command prints them
    int retry_after_s = 0;
};
template <class T>
using Answer = std::variant<T, Problem>;

}  // namespace postchain::service
