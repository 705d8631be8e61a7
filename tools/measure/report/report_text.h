// report.md: the tables of the page for papers and CI logs.
#pragma once

#include <string>

#include "tools/measure/report/report.h"

namespace postchain::report {

std::string report_as_markdown(const Report& report);

// Writes it as report.md in report.folder, whole or not at all. Errors (output).
Status write_report_markdown(const Report& report);

}  // namespace postchain::report
