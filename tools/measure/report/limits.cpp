#include "tools/measure/report/limits.h"

#include <algorithm>

#include "chain/parameter.h"

namespace postchain::report {

Result<MetricLimit> parse_limit(const std::string& option, const std::string& text,
                                const std::vector<MetricInfo>& columns) {
    ASSIGN_OR_RETURN(auto limit, metrics::parse_limit(option, text));
    const auto column = std::find_if(columns.begin(), columns.end(), [&](const MetricInfo& info) {
        return info.name == limit.metric;
    });
    if (column == columns.end()) {
        std::vector<std::string> names;
        for (const auto& info : columns) names.push_back(info.name);
        const std::string near = nearest_word(limit.metric, names);
        return Status(StatusCode::usage,
                      option + ": no metric '" + limit.metric + "'" +
                          (near.empty() ? "" : "; did you mean '" + near + "'?"));
    }
    if (column->better != Better::lower)
        return Status(StatusCode::usage,
                      option + ": " + limit.metric + " is not an error; give one, as in flip=0.05");
    return limit;
}

std::vector<std::string> exceeding(const Report& report, const std::vector<MetricLimit>& limits) {
    std::vector<std::string> lines;
    for (const MetricLimit& limit : limits) {
        for (const Variant& variant : report.variants) {
            const auto series = variant.metrics.find(limit.metric);
            if (series == variant.metrics.end() || !series->second.mean) continue;
            if (*series->second.mean > limit.value)
                lines.push_back(concat(variant.name, ": ", limit.metric, " ", *series->second.mean,
                                       " is above ", limit.value));
        }
    }
    for (const Variant& variant : report.variants)
        if (const auto series = variant.metrics.find("nonfinite"); series != variant.metrics.end())
            if (const std::string fault =
                    metrics::nonfinite_fault(limits, series->second.mean.value_or(0));
                !fault.empty())
                lines.push_back(variant.name + ": " + fault);
    return lines;
}

}  // namespace postchain::report
