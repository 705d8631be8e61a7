// report.json of a report: docs/report.md lists its keys, which are a contract.
#pragma once

#include "tools/measure/report/report.h"
#include "tools/sequence/files/json.h"

namespace postchain::report {

io::Json report_json(const Report& report);

// Writes it as report.json in report.folder, whole or not at all. Errors (output).
Status write_report_json(const Report& report);

}  // namespace postchain::report
