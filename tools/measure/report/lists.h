// Lists for the tables: scored variants, variants by time, elided work; doubtful times.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "tools/measure/report/report.h"

namespace postchain::report {

// A row of the tables of metrics: each variant, then the unfiltered input if it was scored.
struct ScoredRow {
    std::string name;
    const Metrics* metrics;
    const Variant* variant;  // null: the input
};
inline constexpr const char* kInputName = "input";
std::vector<ScoredRow> scored_rows(const Report& report);
std::optional<double> mean_of(const Metrics& metrics, const std::string& metric);

// Variants with a time, the fastest first.
std::vector<const Variant*> by_time(const Report& report);

// One sentence that names untrustworthy times and the reason; empty: none.
std::string doubt_about_times(const Report& report);

// Work that the plans of a variant elided over a sequence: one row for each item and rule.
struct ElisionRow {
    std::string variant;  // its name, or "all"
    std::string what;     // item_text()
    std::string rule;
    // In words. They differ between frames, because figures in them change; the first is that of
    // the first frame.
    std::vector<std::string> reasons;
    std::vector<int> frames;
    Saving saving;  // sum over the frames
    bool operator==(const ElisionRow&) const = default;
};
// In the order of first appearance. Rows that are equal in all variants come first and once, under
// "all". report.json and all tables of elided work use them.
std::vector<ElisionRow> elision_rows(const Report& report);

}  // namespace postchain::report
