// The lists that tables print: what was scored, variants by time, what was elided; doubts.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "tools/measure/report/report.h"

namespace postchain::report {

// A row of the tables of metrics: each variant, then the unfiltered input where it was scored.
struct ScoredRow {
    std::string name;
    const Metrics* metrics;
    const Variant* variant;  // null: the input
};
inline constexpr const char* kInputName = "input";
std::vector<ScoredRow> scored_rows(const Report& report);
std::optional<double> mean_of(const Metrics& metrics, const std::string& metric);

// Those that have a time, the quickest first.
std::vector<const Variant*> by_time(const Report& report);

// Which times are not to be trusted and why, in one sentence; empty: all are.
std::string doubt_about_times(const Report& report);

// What the plans of a variant elided over a sequence: one row for each thing and rule.
struct ElisionRow {
    std::string variant;  // its name, or "all"
    std::string what;     // item_text()
    std::string rule;
    // In words, different ones over the frames: figures in them change. That of the first frame is
    // the first.
    std::vector<std::string> reasons;
    std::vector<int> frames;
    Saving saving;  // sum over the frames
    bool operator==(const ElisionRow&) const = default;
};
// In the order of first appearance; rows that are the same in all variants are first and once,
// under "all". report.json carries them, and everything that prints what was left out uses these.
std::vector<ElisionRow> elision_rows(const Report& report);

}  // namespace postchain::report
