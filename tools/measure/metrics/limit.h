// A limit of a metric as it is typed: "flip=0.05".
#pragma once

#include <string>

#include "chain/status.h"

namespace postchain::metrics {

struct MetricLimit {
    std::string metric;
    double value = 0;
};
// Errors (usage): not METRIC=NUMBER, or a number that is not finite; `option` is named in the
// message. Whether there is such a metric is for the caller to say.
Result<MetricLimit> parse_limit(const std::string& option, const std::string& text);

}  // namespace postchain::metrics
