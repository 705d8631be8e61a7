// Which variants of a bench are worth their time: the Pareto set, the cheapest under a limit.
#pragma once

#include <string>
#include <vector>

#include "tools/measure/report/limits.h"
#include "tools/measure/report/report.h"

namespace postchain::experiment {

// Marks the variants that no other beats in both total time and the mean of `metric`.
void mark_pareto(report::Report& report, const std::string& metric);

// For each limit the variant with the least total time whose mean is within it: a line in
// report.under, its chain in DIR/under_METRIC.yaml. False when some limit is met by none.
// Errors (output).
Result<bool> choose_under(report::Report& report, const std::vector<report::MetricLimit>& limits);

// Chain file of the variant that --under METRIC=... has picked: "under_flip.yaml".
std::string under_file(const std::string& metric);

}  // namespace postchain::experiment
