// Parses a metric's limit: "flip=0.05".
#pragma once

#include <string>

#include "chain/status.h"

namespace postchain::metrics {

struct MetricLimit {
    std::string metric;
    double value = 0;
};
// Errors (usage), naming `option`: not METRIC=NUMBER, or a number that is not finite. The caller
// checks whether the metric exists.
Result<MetricLimit> parse_limit(const std::string& option, const std::string& text);

}  // namespace postchain::metrics
