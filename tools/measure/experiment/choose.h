// Selects variants of a bench: the Pareto set, and the cheapest under a limit.
#pragma once

#include <string>
#include <vector>

#include "tools/measure/report/limits.h"
#include "tools/measure/report/report.h"

namespace postchain::experiment {

// Marks the variants that no other variant beats in both total time and the mean of `metric`.
void mark_pareto(report::Report& report, const std::string& metric);

// For each limit, picks the variant with the least total time whose mean is within it: adds a line
// to report.under and writes its chain to DIR/under_METRIC.yaml. False if no variant meets some
// limit. Errors (output).
Result<bool> choose_under(report::Report& report, const std::vector<report::MetricLimit>& limits);

// File name of the chain picked by --under METRIC=...: "under_flip.yaml".
std::string under_file(const std::string& metric);

}  // namespace postchain::experiment
