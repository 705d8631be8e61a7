// report.csv and report.md: the twins of the page for papers and CI logs.
#pragma once

#include <string>

#include "tools/measure/report/report.h"

namespace postchain::report {

std::string report_as_csv(const Report& report);  // a row per variant and frame, and the means
std::string report_as_markdown(const Report& report);

// The same as report.csv, report.md in report.folder, each whole or not at all. Errors (output).
Status write_report_csv(const Report& report);
Status write_report_markdown(const Report& report);

}  // namespace postchain::report
