// report.csv, the numbers of a report for spreadsheets and scripts, and report.md, the tables of
// its page for papers and CI logs.
#pragma once

#include <string>
#include <vector>

#include "tools/measure/report/report.h"

namespace postchain::report {

// A row per variant and frame, then a row of means; then these rows for the unfiltered input.
std::string report_as_csv(const Report& report);
std::string report_as_markdown(const Report& report);

// Rows of a Markdown table, with their ends.
std::string markdown_row(const std::vector<std::string>& cells);
std::string markdown_header(const std::vector<std::string>& cells);

}  // namespace postchain::report
