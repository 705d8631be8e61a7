// report.csv: the numbers of a report for spreadsheets and scripts.
#pragma once

#include <string>

#include "tools/measure/report/report.h"

namespace postchain::report {

// A row per variant and frame, then a row of means; then these rows for the unfiltered input.
std::string report_as_csv(const Report& report);

// Writes it as report.csv in report.folder, whole or not at all. Errors (output).
Status write_report_csv(const Report& report);

}  // namespace postchain::report
