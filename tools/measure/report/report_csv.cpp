#include "tools/measure/report/report_csv.h"

#include "tools/measure/report/lists.h"
#include "tools/measure/report/words.h"

namespace postchain::report {
namespace {

std::string number(const std::optional<double>& value) {
    return value ? figure(*value, 9) : "";
}

// A text field after RFC 4180. An apostrophe precedes text that a spreadsheet would read as a
// formula.
std::string field(const std::string& name) {
    const bool formula =
        !name.empty() && std::string("=+-@\t\r").find(name[0]) != std::string::npos;
    const std::string text = formula ? "'" + name : name;
    if (text.find_first_of(",\"\r\n") == std::string::npos) return text;
    std::string quoted = "\"";
    for (char c : text) quoted += c == '"' ? std::string("\"\"") : std::string(1, c);
    return quoted + "\"";
}

std::string csv_times(const Variant& variant) {
    if (!variant.timing) return ",,,";
    return "," + number(variant.timing->total.median_ms) + "," +
           number(variant.timing->total.spread_ms) + "," +
           (variant.timing->trustworthy ? "yes" : "no");
}

std::string csv_split(const Variant& variant) {
    if (!variant.split) return ",,,,,";
    const ErrorParts& mse = variant.split->mse;
    std::string text;
    for (const auto& value :
         {mse.precision, mse.sampling, mse.model, variant.split->cross, mse.total})
        text += "," + number(value);
    return text;
}

}  // namespace

std::string report_as_csv(const Report& report) {
    std::string out = "variant,chain_hash,frame";
    for (const MetricInfo& metric : report.metrics) out += "," + field(metric.name);
    out +=
        ",total_ms,total_spread_ms,time_trusted,mse_precision,mse_sampling,mse_model,mse_cross,"
        "mse_total,pareto,failure\n";
    for (const ScoredRow& row : scored_rows(report)) {
        const Variant* variant = row.variant;
        const auto line = [&](const std::string& frame, const auto& value_of, bool whole) {
            out +=
                field(row.name) + "," + (variant ? hex_of(variant->chain_hash) : "") + "," + frame;
            for (const MetricInfo& metric : report.metrics) {
                const auto found = row.metrics->find(metric.name);
                out += "," + (found == row.metrics->end() ? std::string()
                                                          : number(value_of(found->second)));
            }
            out += whole && variant
                       ? csv_times(*variant) + csv_split(*variant) + "," +
                             (variant->pareto ? "yes" : "no") + "," + field(variant->failure)
                       : ",,,,,,,,,,";
            out += "\n";
        };
        for (size_t i = 0; i < report.frames.size(); ++i)
            line(
                std::to_string(report.frames[i]),
                [&](const Series& series) {
                    return i < series.frames.size() ? series.frames[i] : std::nullopt;
                },
                false);
        line(
            "mean", [](const Series& series) { return series.mean; }, true);
    }
    return out;
}

Status write_report_csv(const Report& report) {
    return report.write(report.folder + "/report.csv", report_as_csv(report));
}

}  // namespace postchain::report
