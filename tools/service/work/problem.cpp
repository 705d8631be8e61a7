#include "tools/service/work/problem.h"

#include <algorithm>

namespace postchain::service {

Problem refusal(Problem::Kind kind, Diagnostics diagnostics) {
    const auto is_error = [](const Diagnostic& one) { return one.severity == Severity::error; };
    const auto first = std::find_if(diagnostics.begin(), diagnostics.end(), is_error);
    const auto errors = std::count_if(diagnostics.begin(), diagnostics.end(), is_error);
    std::string detail = first == diagnostics.end() ? "" : first->text();
    if (errors > 1) detail += concat(" (and ", errors - 1, " more)");
    return {kind, std::move(detail), std::move(diagnostics), 0};
}

}  // namespace postchain::service
