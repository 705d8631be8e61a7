// Conclusions from the values of a report: the differences of ab, the Pareto set and the choices
// of bench, the winner, the variants no better than the unfiltered input, and limits.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "tools/measure/experiment/statistics.h"
#include "tools/measure/report/report.h"
#include "tools/metrics/compare.h"

namespace postchain::experiment {

// The metric that decides; docs/metrics.md uses it for whole images.
inline constexpr const char* kDecidingMetric = "hdr_flip";

// The ground truth is too noisy for a metric that is best at 1 if an error-free image would deviate
// by more than kNoiseShare, and for mse and psnr if its noise is more than kNoiseOfError of the
// smallest MSE. docs/metrics.md, "Noise of the ground truth".
inline constexpr double kNoiseShare = 0.06;
inline constexpr double kNoiseOfError = 0.5;

// Sets report.winner and adds to report.warnings; both need a ground truth. Means must be set, and
// for ab the comparison.
// ab: the winner by the paired t-interval of HDR-FLIP. bench: the lowest mean HDR-FLIP of the
// variants that did not fail.
// Warns about variants whose mean HDR-FLIP, over frames they share with the input, is not below the
// input's; from kFewFrames frames on also about those whose t-interval contains 0.
//   Warns about each metric for which the ground truth is too noisy.
void state_outcome(report::Report& report);

inline constexpr uint64_t kBootstrapSeed = 20131101;
inline constexpr int kBootstrapReplicates = 2000;
inline constexpr int kBootstrapTilePx = 32;

// report.comparison of ab: tests the differences between the variants' series, and describes them
// in words. `tiles`: by metric.
report::Comparison compare_variants(const report::Report& report,
                                    const std::map<std::string, TileBootstrap>& tiles);

// Marks the variants that no other variant beats in both total time and the mean of `metric`.
void mark_pareto(report::Report& report, const std::string& metric);

// For each limit, picks the variant with the least total time whose mean is within it: adds a line
// to report.under and writes its chain to DIR/under_METRIC.yaml. False if no variant meets some
// limit. Errors (output).
Result<bool> choose_under(report::Report& report, const std::vector<metrics::MetricLimit>& limits);

// File name of the chain picked by --under METRIC=...: "under_flip.yaml".
std::string under_file(const std::string& metric);

// "flip=0.05". Errors (usage): another form, an unknown metric (the message suggests the closest
// name), a metric whose best value is not the lowest. The message names the setting `key`.
Result<metrics::MetricLimit> parse_limit(const std::string& key, const std::string& text,
                                         const std::vector<report::MetricInfo>& columns);

// One line per variant whose mean is above the limit: "paper: flip 0.12 is above 0.05".
std::vector<std::string> exceeding(const report::Report& report,
                                   const std::vector<metrics::MetricLimit>& limits);

// Exit code of an experiment whose report is written: kExitSomeFailed if a variant failed;
// kExitThreshold if a mean exceeds its limit (each adds a line to `broken`) or not all of a bench's
// limits are `met`; otherwise kExitOk.
int exit_code_of(const report::Report& report, const std::vector<metrics::MetricLimit>& limits,
                 bool met, std::vector<std::string>& broken);

// Parses "flip=0.05" options. Errors (usage): those of parse_limit().
Result<std::vector<metrics::MetricLimit>> limits_of(const std::string& key,
                                                    const std::vector<std::string>& texts,
                                                    report::Kind kind, bool with_truth);

}  // namespace postchain::experiment
