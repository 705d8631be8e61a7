// The lists that tables print: variants by time, and what was left out; doubts.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "tools/measure/report/report.h"

namespace postchain::report {

// Those that have a time, the quickest first.
std::vector<const Variant*> by_time(const Report& report);

// Which times are not to be trusted and why, in one sentence; empty: all are.
std::string doubt_about_times(const Report& report);

// What the plans of a variant left out over a sequence, one line for each thing and rule.
struct LeftOutLine {
    std::string what, rule;
    std::string reason;  // of the first frame
    int reasons = 0;     // different ones over the frames: figures in them change
    std::vector<int> frames;
    uint64_t bytes = 0, taps = 0;  // sums over the frames
    int dispatches = 0;
    bool operator==(const LeftOutLine&) const = default;
};
// In the order of first appearance.
std::vector<LeftOutLine> left_out_lines(const Variant& variant);
// Of all variants, with the variant's name; lines that are the same in all of them come first and
// once, under "all".
std::vector<std::pair<std::string, LeftOutLine>> left_out_rows(const Report& report);

}  // namespace postchain::report
