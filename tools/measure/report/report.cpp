#include "tools/measure/report/report.h"

#include <algorithm>
#include <utility>

namespace postchain::report {

Status Report::write(const std::string& path, std::string_view text) const {
    return files.put(path, text);
}

const char* name_of(Kind kind) {
    return kind == Kind::ab ? "ab" : "bench";
}

const char* name_of(Better better) {
    constexpr const char* kNames[] = {"lower", "higher", "one"};
    return kNames[size_t(better)];
}

const char* words_of(Better better, std::string_view reference) {
    constexpr const char* kWords[] = {"lower is better", "higher is better", "best at 1"};
    constexpr const char* kLikeness[] = {"lower is more alike", "higher is more alike",
                                         "alike at 1"};
    return (reference == "a" ? kLikeness : kWords)[size_t(better)];
}

const char* name_of(Finding finding) {
    constexpr const char* kNames[] = {"too_few_frames", "no_measurable_difference", "a_better",
                                      "b_better"};
    return kNames[size_t(finding)];
}

const char* name_of(ImageKind kind) {
    constexpr const char* kNames[] = {"input", "truth", "color", "error", "converged", "slice"};
    return kNames[size_t(kind)];
}

const StoredImage* Report::find(ImageKind of, int variant, int frame,
                                const std::string& map) const {
    for (const StoredImage& image : images)
        if (image.kind == of && image.variant == variant && image.frame == frame &&
            image.map == map)
            return &image;
    return nullptr;
}

std::vector<ScoredRow> scored_rows(const Report& report) {
    std::vector<ScoredRow> rows;
    for (const Variant& variant : report.variants)
        rows.push_back({variant.name, &variant.metrics, &variant});
    if (!report.input_metrics.empty()) rows.push_back({kInputName, &report.input_metrics, nullptr});
    return rows;
}

std::optional<double> mean_of(const Metrics& metrics, const std::string& metric) {
    const auto series = metrics.find(metric);
    return series == metrics.end() ? std::nullopt : series->second.mean;
}

std::vector<const Variant*> by_time(const Report& report) {
    std::vector<const Variant*> timed;
    for (const Variant& variant : report.variants)
        if (variant.timing) timed.push_back(&variant);
    std::ranges::stable_sort(
        timed, {}, [](const Variant* variant) { return variant->timing->total.median_ms; });
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

namespace {

// Rows of one variant without its name, in the order of first appearance.
std::vector<ElisionRow> rows_of(const Variant& variant) {
    std::vector<ElisionRow> rows;
    for (const auto& [frame, elision] : variant.elisions) {
        const std::string what = item_text(elision, variant.passes);
        auto row = std::ranges::find_if(rows, [&, &e = elision](const auto& one) {
            return one.what == what && one.rule == e.rule;
        });
        if (row == rows.end()) row = rows.insert(row, {"", what, elision.rule, {}, {}, {}});
        const std::string reason = text_of(elision.fact);
        if (std::ranges::find(row->reasons, reason) == row->reasons.end())
            row->reasons.push_back(reason);
        if (row->frames.empty() || row->frames.back() != frame) row->frames.push_back(frame);
        row->saving += elision.saving;
    }
    return rows;
}

}  // namespace

std::vector<ElisionRow> elision_rows(const Report& report) {
    std::vector<std::pair<std::string, std::vector<ElisionRow>>> all;
    for (const Variant& variant : report.variants)  // without those that failed before a plan
        if (variant.failure.empty() || !variant.elisions.empty())
            all.emplace_back(variant.name, rows_of(variant));
    const auto common = [&](const ElisionRow& row) {
        return all.size() > 1 && std::ranges::all_of(all, [&](const auto& one) {
                   return std::ranges::find(one.second, row) != one.second.end();
               });
    };
    std::vector<ElisionRow> rows;
    const auto add = [&](const std::string& variant, ElisionRow row) {
        row.variant = variant;
        rows.push_back(std::move(row));
    };
    if (!all.empty())
        for (const ElisionRow& row : all.front().second)
            if (common(row)) add("all", row);
    for (const auto& [name, its] : all)
        for (const ElisionRow& row : its)
            if (!common(row)) add(name, row);
    return rows;
}

}  // namespace postchain::report
