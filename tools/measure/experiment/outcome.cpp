#include "tools/measure/experiment/outcome.h"

#include <algorithm>
#include <cmath>

#include "tools/measure/experiment/statistics.h"
#include "tools/measure/report/lists.h"
#include "tools/measure/report/words.h"

namespace postchain::experiment {
namespace {

constexpr size_t kNamed = 5;  // maximum number of variants to name in one sentence

const report::Series* series_of(const report::Metrics& metrics, const std::string& name) {
    const auto found = metrics.find(name);
    return found == metrics.end() ? nullptr : &found->second;
}

std::optional<report::Winner> winner_of_ab(const report::Report& report) {
    if (!report.comparison) return std::nullopt;
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

std::optional<report::Winner> winner_of_bench(const report::Report& report) {
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
        if (decided && interval->low <= 0 && interval->high >= 0)
            open.push_back(concat(figures, " (t-interval of the difference ",
                                  report::figure(interval->low), " .. ",
                                  report::figure(interval->high), ")"));
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

}  // namespace

void state_outcome(report::Report& report) {
    if (report.reference != "truth") return;
    report.winner =
        report.kind == report::Kind::ab ? winner_of_ab(report) : winner_of_bench(report);
    compare_with_input(report);
    doubt_truth(report);
}

}  // namespace postchain::experiment
