// Parts of report.json that bench also keeps in DIR/results and reads when it continues.
#pragma once

#include <optional>

#include "tools/measure/report/report.h"
#include "tools/sequence/files/json.h"

namespace postchain::report {

using io::Json;

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
