// Limits of metrics: --fail-above flip=0.05, --under flip=0.1.
#pragma once

#include <string>
#include <vector>

#include "tools/measure/metrics/limit.h"
#include "tools/measure/report/report.h"

namespace postchain::report {

using metrics::MetricLimit;
// "flip=0.05". Errors (usage): another form, an unknown metric (the message suggests the closest
// name), a metric whose best value is not the lowest. The message names `option`.
Result<MetricLimit> parse_limit(const std::string& option, const std::string& text,
                                const std::vector<MetricInfo>& columns);

// One line per variant whose mean is above the limit: "paper: flip 0.12 is above 0.05".
std::vector<std::string> exceeding(const Report& report, const std::vector<MetricLimit>& limits);

}  // namespace postchain::report
