#include "tools/service/work/problem.h"

#include <algorithm>

namespace postchain::service {

Problem problem_of(const Status& status, const Roots& roots) {
    const std::string detail = roots.shown_in(status.message());
    switch (status.code()) {
        case StatusCode::gl:
            return {Problem::Kind::unavailable, detail, {}, kRetryAfterS};
        case StatusCode::internal:
            return {Problem::Kind::internal, detail};
        default:
            return {Problem::Kind::invalid, detail};
    }
}

Problem not_found(const std::string& detail) {
    return {Problem::Kind::not_found, detail};
}

Problem refusal(Problem::Kind kind, Diagnostics diagnostics) {
    const auto is_error = [](const Diagnostic& one) { return one.severity == Severity::error; };
    const auto first = std::ranges::find_if(diagnostics, is_error);
    const auto errors = std::ranges::count_if(diagnostics, is_error);
    std::string detail = first == diagnostics.end() ? "" : first->text();
    if (errors > 1) detail += concat(" (and ", errors - 1, " more)");
    return {kind, std::move(detail), std::move(diagnostics)};
}

}  // namespace postchain::service
