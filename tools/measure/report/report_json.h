// report.json of a report: docs/report.md lists its keys, which are a contract. Parts of it are
// also kept in DIR/results and read when bench continues.
#pragma once

#include <optional>
#include <vector>

#include "tools/measure/report/report.h"
#include "tools/sequence/files/json.h"

namespace postchain::report {

using io::Json;

Json report_json(const Report& report);

Json json_of(const std::optional<double>& value);  // null for none, NaN, Inf
Json json_of(const std::vector<std::optional<double>>& values);
Json json_of(const Timing& timing);
Json json_of(const ErrorSplit& split);
// As elision_json(), without the keys of the work list, which belong to one frame's plan.
Json json_of(const Elision& elision, const std::string& what = {});

// No value if json_of() did not write `json`.
std::optional<Timing> timing_from(const Json& json);
std::optional<ErrorSplit> split_from(const Json& json);
std::optional<Elision> elision_from(const Json& json);

}  // namespace postchain::report
