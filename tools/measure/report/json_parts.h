// Pieces of report.json that bench also keeps in DIR/results, and reads again when it goes on.
#pragma once

#include <optional>

#include "tools/measure/report/report.h"
#include "tools/sequence/io/json.h"

namespace postchain::report {

using io::Json;

Json json_of(const std::optional<double>& value);  // null for none, NaN, Inf
Json json_of(const Timing& timing);
Json json_of(const ErrorSplit& split);
// As elision_json(), without what belongs to one frame's plan: the work list.
Json json_of(const Elision& elision, const std::string& what = {});

// Nothing when `json` is not what json_of() writes.
std::optional<Timing> timing_from(const Json& json);
std::optional<ErrorSplit> split_from(const Json& json);
std::optional<Elision> elision_from(const Json& json);

}  // namespace postchain::report
