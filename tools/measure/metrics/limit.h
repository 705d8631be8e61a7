// Parses a metric's limit: "flip=0.05".
#pragma once

#include <string>
#include <vector>

#include "chain/status.h"

namespace postchain::metrics {

struct MetricLimit {
    std::string metric;
    double value = 0;
};
// Errors (usage), naming `option`: not METRIC=NUMBER, or a number that is not finite. The caller
// checks whether the metric exists.
Result<MetricLimit> parse_limit(const std::string& option, const std::string& text);

// Metrics read a pixel with NaN or Inf as 0, so that no limit notices it: if there is any limit,
// such pixels fail too, unless a limit of `nonfinite` allows that many. Empty: they do not.
std::string nonfinite_fault(const std::vector<MetricLimit>& limits, double pixels);

}  // namespace postchain::metrics
