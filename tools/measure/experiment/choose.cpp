#include "tools/measure/experiment/choose.h"

#include "tools/measure/report/words.h"

namespace postchain::experiment {
namespace {

std::optional<double> mean_of(const report::Variant& variant, const std::string& metric) {
    const auto series = variant.metrics.find(metric);
    return series == variant.metrics.end() ? std::nullopt : series->second.mean;
}

}  // namespace

void mark_pareto(report::Report& report, const std::string& metric) {
    report.pareto_metric = metric;
    const auto usable = [&](const report::Variant& variant) {
        return variant.failure.empty() && variant.timing && mean_of(variant, metric);
    };
    for (report::Variant& variant : report.variants) {
        variant.pareto = usable(variant);
        for (const report::Variant& other : report.variants) {
            if (!variant.pareto) break;
            if (&other == &variant || !usable(other)) continue;
            const double t = variant.timing->total.median_ms, e = *mean_of(variant, metric);
            const double u = other.timing->total.median_ms, f = *mean_of(other, metric);
            if (u <= t && f <= e && (u < t || f < e)) variant.pareto = false;
        }
    }
}

Result<bool> choose_under(report::Report& report, const std::vector<report::MetricLimit>& limits) {
    bool all = true;
    for (const report::MetricLimit& limit : limits) {
        const report::Variant* cheapest = nullptr;
        const report::Variant* nearest = nullptr;
        for (const report::Variant& variant : report.variants) {
            const auto error = mean_of(variant, limit.metric);
            if (!variant.failure.empty() || !variant.timing || !error) continue;
            if (!nearest || *error < *mean_of(*nearest, limit.metric)) nearest = &variant;
            if (*error > limit.value) continue;
            if (!cheapest || variant.timing->total.median_ms < cheapest->timing->total.median_ms)
                cheapest = &variant;
        }
        const std::string wish = concat(limit.metric, " <= ", limit.value, ": ");
        if (!cheapest) {
            all = false;
            report.under.push_back(
                nearest ? concat(wish, "no variant; the closest is ", nearest->name, " with ",
                                 report::figure(*mean_of(*nearest, limit.metric)))
                        : wish + "no variant has a value");
            continue;
        }
        const std::string file = under_file(limit.metric);
        report.under.push_back(concat(wish, cheapest->name, " with ",
                                      report::figure(*mean_of(*cheapest, limit.metric)), " in ",
                                      report::figure(cheapest->timing->total.median_ms, 3),
                                      " ms; its chain is ", file));
        RETURN_IF_ERROR(report.write(report.folder + "/" + file, cheapest->chain_text));
    }
    return all;
}

std::string under_file(const std::string& metric) {
    return "under_" + metric + ".yaml";
}

}  // namespace postchain::experiment
