// Limits of metrics: --fail-above flip=0.05, --under flip=0.1.
#pragma once

#include <string>
#include <vector>

#include "tools/measure/metrics/limit.h"
#include "tools/measure/report/report.h"

namespace postchain::report {

using metrics::MetricLimit;
// "flip=0.05". Errors (usage): another form, an unknown metric (the nearest is named), a metric
// of which more is better or 1 is best. `option` is named in the message.
Result<MetricLimit> parse_limit(const std::string& option, const std::string& text,
                                const std::vector<MetricInfo>& columns);

// One line per variant whose mean is above the limit: "paper: flip 0.12 is above 0.05".
std::vector<std::string> exceeding(const Report& report, const std::vector<MetricLimit>& limits);

}  // namespace postchain::report
