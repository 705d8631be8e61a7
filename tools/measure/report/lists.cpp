#include "tools/measure/report/lists.h"

#include <algorithm>
#include <set>

namespace postchain::report {

std::vector<const Variant*> by_time(const Report& report) {
    std::vector<const Variant*> timed;
    for (const Variant& variant : report.variants)
        if (variant.timing) timed.push_back(&variant);
    std::stable_sort(timed.begin(), timed.end(), [](const Variant* a, const Variant* b) {
        return a->timing->total.median_ms < b->timing->total.median_ms;
    });
    return timed;
}

std::string doubt_about_times(const Report& report) {
    const auto timed = by_time(report);
    const Variant* first = nullptr;
    int doubtful = 0;
    for (const Variant& variant : report.variants) {
        if (!variant.timing || variant.timing->trustworthy) continue;
        if (!first) first = &variant;
        ++doubtful;
    }
    if (!first) return "";
    const std::string who =
        doubtful == 1 ? first->name : concat(doubtful, " of ", timed.size(), " variants");
    return concat("times of ", who, " are not to be trusted: ", first->timing->why_not,
                  doubtful == 1 ? "" : concat(" (of ", first->name, ")"));
}

std::vector<LeftOutLine> left_out_lines(const Variant& variant) {
    std::vector<LeftOutLine> lines;
    std::vector<std::set<std::string>> reasons;
    for (const auto& [frame, left] : variant.left_out) {
        const auto same =
            std::find_if(lines.begin(), lines.end(), [&, &l = left](const auto& line) {
                return line.what == l.what && line.rule == l.rule;
            });
        const auto at = size_t(same - lines.begin());
        if (same == lines.end()) {
            lines.push_back({left.what, left.rule, left.reason, 0, {}, 0, 0, 0});
            reasons.emplace_back();
        }
        LeftOutLine& line = lines[at];
        if (line.frames.empty() || line.frames.back() != frame) line.frames.push_back(frame);
        reasons[at].insert(left.reason);
        line.reasons = int(reasons[at].size());
        line.bytes += left.bytes;
        line.taps += left.taps;
        line.dispatches += left.dispatches;
    }
    return lines;
}

std::vector<std::pair<std::string, LeftOutLine>> left_out_rows(const Report& report) {
    std::vector<std::pair<std::string, std::vector<LeftOutLine>>> all;
    for (const Variant& variant : report.variants)  // but for those that failed before a plan
        if (variant.failure.empty() || !variant.left_out.empty())
            all.emplace_back(variant.name, left_out_lines(variant));
    const auto common = [&](const LeftOutLine& line) {
        return all.size() > 1 && std::all_of(all.begin(), all.end(), [&](const auto& one) {
                   return std::find(one.second.begin(), one.second.end(), line) != one.second.end();
               });
    };
    std::vector<std::pair<std::string, LeftOutLine>> rows;
    if (!all.empty())
        for (const LeftOutLine& line : all.front().second)
            if (common(line)) rows.emplace_back("all", line);
    for (const auto& [name, lines] : all)
        for (const LeftOutLine& line : lines)
            if (!common(line)) rows.emplace_back(name, line);
    return rows;
}

}  // namespace postchain::report
