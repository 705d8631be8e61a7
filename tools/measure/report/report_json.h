// report.json of a report: keys are a contract, written down in docs/report.md.
#pragma once

#include <string>

#include "tools/measure/report/report.h"

namespace postchain::report {

std::string report_as_json(const Report& report);

// The same as report.json in report.folder, whole or not at all. Errors (output).
Status write_report_json(const Report& report);

}  // namespace postchain::report
