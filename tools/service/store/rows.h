// Rows of the store, converted to jobs and frames.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "tools/service/store/job.h"
#include "tools/service/store/sqlite.h"

namespace postchain::service {

// The queries of job_of() and frame_of(), up to WHERE.
inline constexpr const char* kJob =
    "SELECT id, kind, state, priority, body, message, created_ms, started_ms, ended_ms, frames, "
    "done, failed, exit_code, verdict, owner, bytes FROM jobs ";
inline constexpr const char* kFrame =
    "SELECT frame, state, attempts, output, message, filter_ms FROM frames ";

// The rows of a query, and its first one.
template <class Convert>
auto all(Statement rows, const Convert& convert) {
    std::vector<decltype(convert(rows))> found;
    while (rows.step()) found.push_back(convert(rows));
    return found;
}
template <class Convert>
auto first(Statement rows, const Convert& convert) {
    return rows.step() ? std::optional(convert(rows)) : std::nullopt;
}

// The number of a displayed id; 0 if it is not an id.
int64_t number_of(const std::string& id);

JobState state_of(const std::string& name);
Job job_of(const Statement& row);
JobFrame frame_of(const Statement& row);

}  // namespace postchain::service
