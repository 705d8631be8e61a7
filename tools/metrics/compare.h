// Computes the metrics of a pair by name. One table drives the command, its help and the reports.
#pragma once

#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "tools/metrics/error.h"
#include "tools/metrics/flip.h"

namespace postchain::metrics {

struct MetricRow {
    std::string name;
    std::string help;
    bool is_error = true;  // 0 = equal, higher = worse; false: higher = better (psnr, ssim)
    // Null: compare() computes it with others (FLIP with its map, all percentiles together).
    std::optional<double> (*measure)(const Pair&) = nullptr;
};
// flip, hdr_flip, relmse, smape, mse, psnr, ssim, nonfinite, then the distribution of differences.
const std::vector<MetricRow>& metric_rows();
// Null if the name is unknown.
const MetricRow* find_metric(const std::string& name);

struct MapRow {
    std::string name;
    std::string help;
    double shown_max;  // the value that is shown brightest; 0 is darkest
};
const std::vector<MapRow>& map_rows();  // flip, hdr_flip, relmse, smape, difference
const MapRow* find_map(const std::string& name);

struct CompareSettings {
    std::set<std::string> metrics;  // names of metric_rows(); empty = all
    FlipSettings flip;
    std::optional<ExposureRange> exposures;  // none = from this pair's reference
    std::string map;                         // a name of map_rows(); empty = none
};

// Metrics by name.
using Values = std::vector<std::pair<std::string, std::optional<double>>>;

struct Comparison {
    // In the table's order. No value if the metric is undefined (PSNR of equal images, SSIM of an
    // image smaller than its window).
    Values values;
    ExposureRange exposures;  // exposures of hdr_flip
    ImageF map;               // one channel; empty if not requested

    std::optional<double> value(const std::string& name) const;
};

// Errors (usage): an unknown metric or map.
Result<Comparison> compare(const Pair& pair, const CompareSettings& settings);

// The values of a sequence from those of its frames (at least one): means over the frames that have
// a value; counts are summed, maxima are maximized.
Values summary_of(const std::vector<Values>& frames);

// Every constant that values depend on, by name: {"relmse_epsilon", 0.01}, ...
std::vector<std::pair<std::string, double>> metric_constants();

// A limit on a metric: "flip=0.05".
struct MetricLimit {
    std::string metric;
    double value = 0;
};
// Errors (usage), naming the setting: not METRIC=NUMBER, or a number that is not finite. The caller
// checks whether the metric exists.
Result<MetricLimit> parse_limit(const std::string& key, const std::string& text);

// Metrics read a pixel with NaN or Inf as 0, so that no limit notices it: if there is any limit,
// such pixels fail too, unless a limit of `nonfinite` allows that many. Empty: they do not.
std::string nonfinite_fault(const std::vector<MetricLimit>& limits, double pixels);

}  // namespace postchain::metrics
