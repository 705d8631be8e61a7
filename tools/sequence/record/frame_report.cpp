#include "tools/sequence/record/frame_report.h"

namespace postchain::sequence {

const char* name_of(Outcome outcome) {
    switch (outcome) {
        case Outcome::written:
            return "written";
        case Outcome::skipped:
            return "skipped";
        case Outcome::held:
            return "held";
        case Outcome::missing:
            return "missing";
        case Outcome::failed:
            return "failed";
    }
    return "unknown";
}

}  // namespace postchain::sequence

namespace postchain {

int exit_code(const Status& status) {
    switch (status.code()) {
        case StatusCode::ok:
            return kExitOk;
        case StatusCode::usage:
            return kExitUsage;
        case StatusCode::chain:
            return kExitChain;
        case StatusCode::input:
        case StatusCode::memory:
            return kExitInput;
        case StatusCode::output:
            return kExitOutput;
        case StatusCode::gl:
            return kExitGl;
        case StatusCode::health:
            return kExitHealth;
        case StatusCode::canceled:
        case StatusCode::internal:
            return kExitSomeFailed;
    }
    return kExitSomeFailed;
}

int exit_code(const Status& first_failure, size_t good) {
    return good > 0 && !first_failure.ok() ? kExitSomeFailed : exit_code(first_failure);
}

int exit_code(const sequence::RunSummary& summary) {
    const size_t bad = summary.failed + summary.missing;
    // --strict checks values: its exit code takes precedence over frames that succeeded.
    if (summary.unhealthy) return kExitHealth;
    if (bad == 0) return summary.held > 0 ? kExitSomeFailed : kExitOk;
    return exit_code(summary.first_failure, summary.written + summary.skipped + summary.held);
}

}  // namespace postchain
