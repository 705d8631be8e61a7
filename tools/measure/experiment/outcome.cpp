#include "tools/measure/experiment/outcome.h"

#include <algorithm>
#include <cmath>

#include "chain/base/parameter.h"
#include "chain/base/text.h"
#include "tools/measure/experiment/experiment.h"
#include "tools/measure/report/report.h"
#include "tools/measure/report/words.h"
#include "tools/sequence/record/frame_report.h"

namespace postchain::experiment {
namespace {

constexpr size_t kNamed = 5;  // maximum number of variants to name in one sentence

const report::Series* series_of(const report::Metrics& metrics, const std::string& name) {
    const auto found = metrics.find(name);
    return found == metrics.end() ? nullptr : &found->second;
}

std::string range(const report::Interval& interval) {
    return report::figure(interval.low) + " .. " + report::figure(interval.high);
}

bool holds_zero(const report::Interval& interval) {
    return interval.low <= 0 && interval.high >= 0;
}

std::optional<report::Winner> winner_of_pair(const report::Report& report) {
    for (const report::MetricComparison& one : report.comparison->metrics) {
        if (one.metric != kDecidingMetric) continue;
        const bool a = one.finding == report::Finding::a_better;
        if (!a && one.finding != report::Finding::b_better) return std::nullopt;
        const size_t won = a ? 0 : 1;
        return report::Winner{
            won, kDecidingMetric,
            concat(report.variants[won].name,
                   " is closer to the ground truth by HDR-FLIP, and the t-interval "
                   "over frames does not contain 0")};
    }
    return std::nullopt;
}

std::optional<report::Winner> winner_of_all(const report::Report& report) {
    std::optional<size_t> best, second;
    const auto value = [&](size_t v) {
        return report::mean_of(report.variants[v].metrics, kDecidingMetric);
    };
    size_t count = 0;
    for (size_t v = 0; v < report.variants.size(); ++v) {
        if (!report.variants[v].failure.empty() || !value(v)) continue;
        ++count;
        if (!best || *value(v) < *value(*best)) {
            second = best;
            best = v;
        } else if (!second || *value(v) < *value(*second)) {
            second = v;
        }
    }
    if (!second) return std::nullopt;  // a single variant has no competitor
    std::string words =
        concat(report.variants[*best].name, " has the lowest mean HDR-FLIP of ", count,
               " variants: ", report::figure(*value(*best)), "; the next is ",
               report.variants[*second].name, " with ", report::figure(*value(*second)));
    return report::Winner{*best, kDecidingMetric, std::move(words)};
}

struct Beside {
    Paired paired;  // variant - input
    double variant = 0, input = 0;
};
std::optional<Beside> beside_input(const report::Report& report, const report::Variant& variant,
                                   const std::string& metric) {
    const auto* mine = series_of(variant.metrics, metric);
    const auto* its = series_of(report.input_metrics, metric);
    if (!mine || !its) return std::nullopt;
    Beside beside;
    std::vector<double> differences;
    for (size_t i = 0; i < std::min(mine->frames.size(), its->frames.size()); ++i) {
        if (!mine->frames[i] || !its->frames[i]) continue;
        differences.push_back(*mine->frames[i] - *its->frames[i]);
        beside.variant += *mine->frames[i];
        beside.input += *its->frames[i];
    }
    if (differences.empty()) return std::nullopt;
    beside.variant /= double(differences.size());
    beside.input /= double(differences.size());
    beside.paired = paired_interval(differences);
    return beside;
}

std::string listed(const std::vector<std::string>& names) {
    std::string text;
    for (size_t i = 0; i < std::min(names.size(), kNamed); ++i) text += (i ? "; " : "") + names[i];
    if (names.size() > kNamed) text += concat("; and ", names.size() - kNamed, " more");
    return text;
}

void compare_with_input(report::Report& report) {
    std::vector<std::string> worse, open;
    for (const report::Variant& variant : report.variants) {
        const auto beside = beside_input(report, variant, kDecidingMetric);
        if (!beside) continue;
        const auto& interval = beside->paired.interval;
        const std::string figures = concat(variant.name, " ", report::figure(beside->variant),
                                           ", the input ", report::figure(beside->input));
        const bool decided = beside->paired.n >= kFewFrames;
        if (decided && holds_zero(*interval))
            open.push_back(
                concat(figures, " (t-interval of the difference ", range(*interval), ")"));
        else if (beside->variant >= beside->input)
            worse.push_back(figures);
    }
    const std::string by = concat(" of ", report::counted(report.variants.size(), "variant"));
    if (!worse.empty())
        report.warnings.push_back(concat(
            worse.size(), by, worse.size() == 1 ? " is" : " are",
            " no better than doing nothing, by mean HDR-FLIP (lower is better): ", listed(worse)));
    if (!open.empty())
        report.warnings.push_back(
            concat(open.size(), by, open.size() == 1 ? " is" : " are",
                   " not measurably better than doing nothing, by HDR-FLIP: ", listed(open)));
}

// Factor on samples per pixel that brings a share of noise to the limit: the noise part of a sum
// falls with 1 / samples, the rest stays.
std::string more_samples(double share) {
    const double times = share / (1 - share) / (kNoiseShare / (1 - kNoiseShare));
    return concat("about ", report::figure(std::ceil(times), 3), " times the samples per pixel");
}

// Without "about N times" if nearly everything is noise.
std::string remedy(double share) {
    return share < 0.95 ? "give the ground truth " + more_samples(share)
                        : "give the ground truth many more samples per pixel";
}

void doubt_truth(report::Report& report) {
    const auto sigma = report::mean_of(report.truth_noise, report::kNoiseSigma);
    if (!sigma) return;
    const std::string noisy = concat("the ground truth is noisy (standard deviation ",
                                     report::figure(*sigma, 2), " of the displayed luma)");
    for (const report::MetricInfo& column : report.metrics) {
        const auto value = report::mean_of(report.truth_noise, column.name);
        if (!value || column.better != report::Better::one || *value >= 1 - kNoiseShare) continue;
        report.warnings.push_back(concat(
            column.name, " is unreliable: ", noisy, ", and an image without any error would have ",
            report::figure(*value, 2), " instead of 1; ", remedy(1 - *value)));
    }
    const report::Variant* nearest = nullptr;
    std::optional<double> least;
    for (const report::Variant& variant : report.variants) {
        const auto mse = report::mean_of(variant.metrics, "mse");
        if (!mse || (least && *mse >= *least)) continue;
        nearest = &variant;
        least = mse;
    }
    const auto of_noise = report::mean_of(report.truth_noise, "mse");
    if (!nearest || !of_noise || *of_noise <= kNoiseOfError * *least) return;
    report.warnings.push_back(concat(
        "mse and psnr are unreliable: ", noisy, ", and its noise by itself makes ",
        report::figure(*of_noise, 2), " of the ", report::figure(*least, 2), " of ", nearest->name,
        "; give the ground truth more samples per pixel (differences "
        "between variants are not affected)"));
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

    // The values of a frame; none: not of both.
    std::optional<std::pair<double, double>> values_of(const std::string& metric, size_t i) const {
        const auto* of_a = series_of(report_.variants[0].metrics, metric);
        const auto* of_b = series_of(report_.variants[1].metrics, metric);
        if (!of_a || !of_b || i >= of_a->frames.size() || i >= of_b->frames.size() ||
            !of_a->frames[i] || !of_b->frames[i])
            return std::nullopt;
        return std::pair(*of_a->frames[i], *of_b->frames[i]);
    }

    // Over the frames of both, as the differences are.
    std::optional<std::pair<double, double>> means(const std::string& metric) const {
        double a = 0, b = 0;
        int n = 0;
        for (size_t i = 0; i < report_.frames.size(); ++i)
            if (const auto values = values_of(metric, i)) {
                a += values->first;
                b += values->second;
                ++n;
            }
        return n ? std::optional(std::pair(a / n, b / n)) : std::nullopt;
    }

    report::MetricComparison compare_metric(const report::MetricInfo& column) const {
        report::MetricComparison result;
        result.metric = column.name;
        std::vector<double> differences;
        for (size_t i = 0; i < report_.frames.size(); ++i) {
            std::optional<double> difference;
            if (const auto values = values_of(column.name, i)) {
                const auto [x, y] = *values;
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
        const bool equal = std::ranges::all_of(differences, [](double d) { return d == 0; });
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
            const auto both = means(metric);
            if (!both) return;
            const auto input = report::mean_of(report_.input_metrics, metric);
            text += concat(
                text.empty() ? "" : " ", what, ": ", a(), " ", report::figure(both->first), ", ",
                b(), " ", report::figure(both->second),
                input ? ", the input " + report::figure(*input) : "", " (1 = ground truth).");
        };
        claim("edges_in_blurred", "Edges in blurred regions");
        claim("sharpness_in_focus", "Sharpness in focus");
        return text.empty() ? "The ground truth has no blurred or sharp regions to measure." : text;
    }

    // Metrics beside the one that decides: their names, or if there are many, their number.
    static std::string listed(const std::vector<report::MetricComparison>& metrics,
                              report::Finding finding) {
        std::vector<std::string> names;
        for (const auto& metric : metrics)
            if (metric.finding == finding && metric.n > 0 && metric.metric != kDecidingMetric)
                names.push_back(metric.metric);
        return names.size() <= 3 ? joined(names) : concat(names.size(), " other metrics");
    }

    std::string failures() const {
        std::string text;
        for (const report::Variant& variant : report_.variants)
            if (!variant.failure.empty())
                text += concat(" ", variant.name, " failed: ", variant.failure, ".");
        return text;
    }

    std::string verdict(const std::vector<report::MetricComparison>& metrics) const {
        const auto main =
            std::ranges::find(metrics, kDecidingMetric, &report::MetricComparison::metric);
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
        const auto both = *means(kDecidingMetric);
        const std::string figures = concat(a(), " ", report::figure(both.first), ", ", b(), " ",
                                           report::figure(both.second));
        std::string text;
        if (main->n < kFewFrames) {
            text = concat("Too few frames to decide (n = ", main->n,
                          "; an interval over frames needs ", kFewFrames,
                          " or more). HDR-FLIP: ", figures, ".");
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
            const bool decided = main->finding == report::Finding::a_better ||
                                 main->finding == report::Finding::b_better;
            text = !decided ? "No measurable difference by HDR-FLIP: "
                            : (main->finding == report::Finding::a_better ? a() : b()) +
                                  " is closer to the ground truth by HDR-FLIP: ";
            text += concat(figures, ", B - A ", range(*main->t_interval), " (95 %, paired over ",
                           main->n, " frames).");
            const std::string for_a = listed(metrics, report::Finding::a_better);
            const std::string for_b = listed(metrics, report::Finding::b_better);
            if (!for_a.empty()) text += concat(" ", a(), " is better by ", for_a, ".");
            if (!for_b.empty()) text += concat(" ", b(), " is better by ", for_b, ".");
        }
        return text + failures();
    }

    std::string without_truth() const {
        const report::Metrics& of_b = report_.variants[1].metrics;
        const auto flip = report::mean_of(of_b, kDecidingMetric);
        if (!flip) return "No frame was filtered by both chains." + failures();
        std::string text = concat("Without a ground truth it is unknown which is more accurate. ");
        const auto error = report::mean_of(of_b, "mse");
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

void state_outcome(report::Report& report) {
    if (report.reference != "truth") return;
    report.winner = report.comparison ? winner_of_pair(report) : winner_of_all(report);
    compare_with_input(report);
    doubt_truth(report);
}

report::Comparison compare_variants(const report::Report& report,
                                    const std::map<std::string, TileBootstrap>& tiles) {
    return Judge(report, tiles).judge();
}

void mark_pareto(report::Report& report, const std::string& metric) {
    report.pareto_metric = metric;
    const auto usable = [&](const report::Variant& variant) {
        return variant.failure.empty() && variant.timing &&
               variant.timing->total.n >= report::kTrustedRepeats &&
               report::mean_of(variant.metrics, metric);
    };
    for (report::Variant& variant : report.variants) {
        variant.pareto = usable(variant);
        for (const report::Variant& other : report.variants) {
            if (!variant.pareto) break;
            if (&other == &variant || !usable(other)) continue;
            const double t = variant.timing->total.median_ms,
                         e = *report::mean_of(variant.metrics, metric);
            const double u = other.timing->total.median_ms,
                         f = *report::mean_of(other.metrics, metric);
            if (u <= t && f <= e && (u < t || f < e)) variant.pareto = false;
        }
    }
}

Result<bool> choose_under(report::Report& report, const std::vector<metrics::MetricLimit>& limits) {
    bool all = true;
    for (const metrics::MetricLimit& limit : limits) {
        const report::Variant* cheapest = nullptr;
        const report::Variant* nearest = nullptr;
        for (const report::Variant& variant : report.variants) {
            const auto error = report::mean_of(variant.metrics, limit.metric);
            if (!variant.failure.empty() || !variant.timing || !error) continue;
            if (!nearest || *error < *report::mean_of(nearest->metrics, limit.metric))
                nearest = &variant;
            if (*error > limit.value) continue;
            if (!cheapest || variant.timing->total.median_ms < cheapest->timing->total.median_ms)
                cheapest = &variant;
        }
        const std::string wish = concat(limit.metric, " <= ", limit.value, ": ");
        if (!cheapest) {
            all = false;
            report.under.push_back(
                nearest ? concat(wish, "no variant; the closest is ", nearest->name, " with ",
                                 report::figure(*report::mean_of(nearest->metrics, limit.metric)))
                        : wish + "no variant has a value");
            continue;
        }
        const std::string file = under_file(limit.metric);
        report.under.push_back(concat(
            wish, cheapest->name, " with ",
            report::figure(*report::mean_of(cheapest->metrics, limit.metric)), " in ",
            report::figure(cheapest->timing->total.median_ms, 3), " ms; its chain is ", file));
        RETURN_IF_ERROR(report.write(report.folder + "/" + file, cheapest->chain_text));
    }
    return all;
}

std::string under_file(const std::string& metric) {
    return "under_" + metric + ".yaml";
}

Result<metrics::MetricLimit> parse_limit(const std::string& key, const std::string& text,
                                         const std::vector<report::MetricInfo>& columns) {
    ASSIGN_OR_RETURN(auto limit, metrics::parse_limit(key, text));
    const auto column = std::ranges::find(columns, limit.metric, &report::MetricInfo::name);
    if (column == columns.end()) {
        std::vector<std::string> names;
        for (const auto& info : columns) names.push_back(info.name);
        const std::string near = nearest_word(limit.metric, names);
        return Status(StatusCode::usage,
                      setting(key) + ": no metric '" + limit.metric + "'" +
                          (near.empty() ? "" : "; did you mean '" + near + "'?"));
    }
    if (column->better != report::Better::lower)
        return Status(StatusCode::usage, setting(key) + ": " + limit.metric +
                                             " is not an error; give one, as in flip=0.05");
    return limit;
}

std::vector<std::string> exceeding(const report::Report& report,
                                   const std::vector<metrics::MetricLimit>& limits) {
    std::vector<std::string> lines;
    for (const metrics::MetricLimit& limit : limits) {
        for (const report::Variant& variant : report.variants) {
            const auto series = variant.metrics.find(limit.metric);
            if (series == variant.metrics.end() || !series->second.mean) continue;
            if (*series->second.mean > limit.value)
                lines.push_back(concat(variant.name, ": ", limit.metric, " ", *series->second.mean,
                                       " is above ", limit.value));
        }
    }
    for (const report::Variant& variant : report.variants)
        if (const auto series = variant.metrics.find("nonfinite"); series != variant.metrics.end())
            if (const std::string fault =
                    metrics::nonfinite_fault(limits, series->second.mean.value_or(0));
                !fault.empty())
                lines.push_back(variant.name + ": " + fault);
    return lines;
}

int exit_code_of(const report::Report& report, const std::vector<metrics::MetricLimit>& limits,
                 bool met, std::vector<std::string>& broken) {
    broken = exceeding(report, limits);
    if (!broken.empty()) return kExitThreshold;
    for (const auto& variant : report.variants)
        if (!variant.failure.empty()) return kExitSomeFailed;
    return met ? kExitOk : kExitThreshold;
}

Result<std::vector<metrics::MetricLimit>> limits_of(const std::string& key,
                                                    const std::vector<std::string>& texts,
                                                    report::Kind kind, bool with_truth) {
    std::vector<metrics::MetricLimit> limits;
    for (const auto& text : texts) {
        ASSIGN_OR_RETURN(auto limit, parse_limit(key, text, metric_columns(kind, with_truth)));
        limits.push_back(std::move(limit));
    }
    return limits;
}

}  // namespace postchain::experiment
