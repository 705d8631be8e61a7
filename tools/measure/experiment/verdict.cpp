#include "tools/measure/experiment/verdict.h"

#include <algorithm>
#include <cmath>

#include "tools/measure/report/lists.h"
#include "tools/measure/report/words.h"

namespace postchain::experiment {
namespace {

std::string range(const report::Interval& interval) {
    return report::figure(interval.low) + " .. " + report::figure(interval.high);
}

bool holds_zero(const report::Interval& interval) {
    return interval.low <= 0 && interval.high >= 0;
}

std::string all_of(int frames) {
    return frames == 1 ? "the one frame" : concat("all ", frames, " frames");
}

// Whether B is better, given B - A (or its distance from 1).
bool favors_b(report::Better better, double difference) {
    return better == report::Better::higher ? difference > 0 : difference < 0;
}

std::string direction(report::Better better, double difference) {
    if (better == report::Better::one)
        return difference < 0 ? "closer to 1 by " : "farther from 1 by ";
    return difference < 0 ? "lower by " : "higher by ";
}

class Judge {
  public:
    Judge(const report::Report& report, const std::map<std::string, TileBootstrap>& tiles)
        : report_(report), tiles_(tiles) {}

    report::Comparison judge() {
        report::Comparison comparison;
        comparison.bootstrap_seed = kBootstrapSeed;
        comparison.bootstrap_replicates = kBootstrapReplicates;
        comparison.bootstrap_tile_px = kBootstrapTilePx;
        if (report_.reference != "truth") {
            comparison.verdict = without_truth();
            return comparison;
        }
        for (const report::MetricInfo& column : report_.metrics)
            comparison.metrics.push_back(compare_metric(column));
        comparison.claims = claims();
        comparison.verdict = verdict(comparison.metrics);
        return comparison;
    }

  private:
    const std::string& a() const { return report_.variants[0].name; }
    const std::string& b() const { return report_.variants[1].name; }

    const report::Series* series(size_t variant, const std::string& metric) const {
        const auto found = report_.variants[variant].metrics.find(metric);
        return found == report_.variants[variant].metrics.end() ? nullptr : &found->second;
    }

    std::optional<double> mean(size_t variant, const std::string& metric) const {
        const report::Series* found = series(variant, metric);
        return found ? found->mean : std::nullopt;
    }

    report::MetricComparison compare_metric(const report::MetricInfo& column) const {
        report::MetricComparison result;
        result.metric = column.name;
        const report::Series* of_a = series(0, column.name);
        const report::Series* of_b = series(1, column.name);
        std::vector<double> differences;
        for (size_t i = 0; i < report_.frames.size(); ++i) {
            std::optional<double> difference;
            if (of_a && of_b && i < of_a->frames.size() && i < of_b->frames.size() &&
                of_a->frames[i] && of_b->frames[i]) {
                const double x = *of_a->frames[i], y = *of_b->frames[i];
                difference = column.better == report::Better::one
                                 ? std::abs(y - 1) - std::abs(x - 1)
                                 : y - x;
                differences.push_back(*difference);
            }
            result.differences.push_back(difference);
        }
        const Paired paired = paired_interval(differences);
        result.n = paired.n;
        if (paired.n > 0) result.mean = paired.mean;
        result.t_interval = paired.interval;
        if (const auto tiles = tiles_.find(column.name); tiles != tiles_.end()) {
            result.bootstrap = tiles->second.interval();
            result.tiles = tiles->second.tiles();
        }
        const bool equal =
            std::all_of(differences.begin(), differences.end(), [](double d) { return d == 0; });
        if (paired.n < kFewFrames)
            result.finding = report::Finding::too_few_frames;
        else if (equal || holds_zero(*paired.interval))
            result.finding = report::Finding::no_measurable_difference;
        else
            result.finding = favors_b(column.better, paired.mean) ? report::Finding::b_better
                                                                  : report::Finding::a_better;
        result.words = words(column, result, equal);
        return result;
    }

    std::string words(const report::MetricInfo& column, const report::MetricComparison& result,
                      bool equal) const {
        if (result.n == 0) return "no frame has a value for both";
        if (equal) return "equal in " + all_of(result.n);
        std::string text;
        if (result.finding == report::Finding::too_few_frames)
            text = concat("too few frames to decide (n = ", result.n, "): in these ");
        else if (result.finding == report::Finding::no_measurable_difference)
            text = concat("no measurable difference (n = ", result.n, "): ");
        text += concat(b(), " is ", direction(column.better, *result.mean),
                       report::figure(std::abs(*result.mean)), " on average");
        if (result.t_interval) text += ", 95 % t-interval " + range(*result.t_interval);
        if (result.finding == report::Finding::a_better ||
            result.finding == report::Finding::b_better)
            text += concat(" (n = ", result.n, ")");
        if (result.bootstrap)
            text += concat("; tiles redrawn within these frames ", range(*result.bootstrap));
        return text;
    }

    std::string claims() const {
        std::string text;
        const auto claim = [&](const char* metric, const char* what) {
            const auto x = mean(0, metric), y = mean(1, metric);
            if (!x || !y) return;
            const auto input = report::mean_of(report_.input_metrics, metric);
            text += concat(text.empty() ? "" : " ", what, ": ", a(), " ", report::figure(*x), ", ",
                           b(), " ", report::figure(*y),
                           input ? ", the input " + report::figure(*input) : "",
                           " (1 = ground truth).");
        };
        claim("edges_in_blurred", "Edges in blurred regions");
        claim("sharpness_in_focus", "Sharpness in focus");
        return text.empty() ? "The ground truth has no blurred or sharp regions to measure." : text;
    }

    std::string listed(const std::vector<report::MetricComparison>& metrics,
                       report::Finding finding) const {
        std::string text;
        for (const auto& metric : metrics)
            if (metric.finding == finding && metric.n > 0)
                text += (text.empty() ? "" : ", ") + metric.metric;
        return text;
    }

    std::string failures() const {
        std::string text;
        for (const report::Variant& variant : report_.variants)
            if (!variant.failure.empty())
                text += concat(" ", variant.name, " failed: ", variant.failure, ".");
        return text;
    }

    std::string verdict(const std::vector<report::MetricComparison>& metrics) const {
        const auto main = std::find_if(metrics.begin(), metrics.end(), [](const auto& metric) {
            return metric.metric == "hdr_flip";
        });
        if (main == metrics.end() || main->n == 0)
            return "No frame was filtered by both chains." + failures();
        bool equal = true;
        for (const auto& metric : metrics)
            for (const auto& difference : metric.differences)
                equal &= !difference || *difference == 0;
        if (equal)
            return concat("No measurable difference: every metric is equal in ", all_of(main->n),
                          ".") +
                   failures();
        std::string text;
        if (main->n < kFewFrames) {
            text = concat("Too few frames to decide (n = ", main->n,
                          "; an interval over frames needs ", kFewFrames,
                          " or more). HDR-FLIP: ", a(), " ", report::figure(*mean(0, "hdr_flip")),
                          ", ", b(), " ", report::figure(*mean(1, "hdr_flip")), ".");
            if (main->bootstrap)
                text +=
                    holds_zero(*main->bootstrap)
                        ? " Even within these frames, bootstrap over tiles does not decide the "
                          "sign of "
                          "the difference (" +
                              range(*main->bootstrap) + ")."
                        : concat(
                              " Within these frames ", *main->mean < 0 ? b() : a(),
                              " is closer to the ground truth (bootstrap over tiles: B - A is in ",
                              range(*main->bootstrap), "); this need not hold for other frames.");
        } else {
            const std::string for_a = listed(metrics, report::Finding::a_better);
            const std::string for_b = listed(metrics, report::Finding::b_better);
            const std::string open = listed(metrics, report::Finding::no_measurable_difference);
            if (for_a.empty() && for_b.empty())
                text = concat("No measurable difference in any metric (n = ", main->n, ").");
            if (!for_a.empty()) text += a() + " is closer to the ground truth by " + for_a + ".";
            if (!for_b.empty())
                text += (text.empty() ? "" : " ") + b() + " is closer to the ground truth by " +
                        for_b + ".";
            if (!open.empty() && !(for_a.empty() && for_b.empty()))
                text += " No measurable difference: " + open + ".";
            text += concat(" HDR-FLIP: ", a(), " ", report::figure(*mean(0, "hdr_flip")), ", ", b(),
                           " ", report::figure(*mean(1, "hdr_flip")), ", B - A ",
                           range(*main->t_interval), ".");
            text += concat(" Intervals are 95 %, paired over ", main->n,
                           " frames, one metric at a time.");
        }
        return text + failures();
    }

    std::string without_truth() const {
        const auto flip = mean(1, "hdr_flip");
        if (!flip) return "No frame was filtered by both chains." + failures();
        std::string text = concat("Without a ground truth it is unknown which is more accurate. ");
        const auto error = mean(1, "mse");
        if (error && *error == 0)
            text += a() + " and " + b() + " give equal images.";
        else
            text +=
                concat("Between ", a(), " and ", b(), " HDR-FLIP is ", report::figure(*flip),
                       " on average over ", report::counted(report_.frames.size(), "frame"), ".");
        return text + failures();
    }

    const report::Report& report_;
    const std::map<std::string, TileBootstrap>& tiles_;
};

}  // namespace

report::Comparison compare_variants(const report::Report& report,
                                    const std::map<std::string, TileBootstrap>& tiles) {
    return Judge(report, tiles).judge();
}

}  // namespace postchain::experiment
