#include "tools/metrics/compare.h"

#include <algorithm>
#include <charconv>
#include <cmath>

#include "tools/metrics/display.h"
#include "tools/metrics/sharpness.h"
#include "tools/metrics/temporal.h"

namespace postchain::metrics {
namespace {

template <class Row>
const Row* find(const std::vector<Row>& rows, const std::string& name) {
    const auto it = std::ranges::find(rows, name, &Row::name);
    return it == rows.end() ? nullptr : &*it;
}

template <class Row>
Status unknown(const char* what, const std::string& name, const std::vector<Row>& rows) {
    std::string known;
    for (const auto& row : rows) known += (known.empty() ? "" : ", ") + row.name;
    return Status(StatusCode::usage, concat("no ", what, " '", name, "'; known are ", known));
}

// A function of the pair as a row's `measure`.
template <auto function>
std::optional<double> measured(const Pair& pair) {
    return function(pair);
}

double nonfinite_pixels(const Pair& pair) {
    return double(pair.test.nonfinite);
}

}  // namespace

const std::vector<MetricRow>& metric_rows() {
    static const std::vector<MetricRow> rows = {
        {"flip", "FLIP of linear values clamped to 0..1, mean"},
        {"hdr_flip", "HDR-FLIP, mean"},
        {"relmse", "mean of (I-R)^2 / (|R| + 0.01)^2", true, measured<relmse>},
        {"smape", "mean of 2|I-R| / (|I| + |R| + 0.02)", true, measured<smape>},
        {"mse", "mean of (I-R)^2", true, measured<mse>},
        {"psnr", "dB after the display transform, peak 1; inf if equal", false, measured<psnr>},
        {"ssim", "on luma after the display transform; none below 11x11 pixels", false,
         measured<ssim>},
        {"nonfinite", "pixels of the tested image with NaN or Inf", true,
         measured<nonfinite_pixels>},
        {"relmse_trimmed", "relmse without the worst 0.1 % of the pixels", true,
         measured<relmse_trimmed>},
        {"difference_p50", "median of the largest |I-R| of each pixel"},
        {"difference_p95", "95th percentile of the same"},
        {"difference_p99", "99th percentile of the same"},
        {"difference_max", "maximum of the same"},
    };
    return rows;
}

const MetricRow* find_metric(const std::string& name) {
    return find(metric_rows(), name);
}

const std::vector<MapRow>& map_rows() {
    static const std::vector<MapRow> rows = {
        {"flip", "FLIP", 1},
        {"hdr_flip", "HDR-FLIP", 1},
        {"relmse", "mean over RGB of (I-R)^2 / (|R| + 0.01)^2", 1},
        {"smape", "mean over RGB of 2|I-R| / (|I| + |R| + 0.02)", 2},
        {"difference", "largest |I-R| over RGB", 1},
    };
    return rows;
}

const MapRow* find_map(const std::string& name) {
    return find(map_rows(), name);
}

std::optional<double> Comparison::value(const std::string& name) const {
    for (const auto& [key, number] : values)
        if (key == name) return number;
    return std::nullopt;
}

Result<Comparison> compare(const Pair& pair, const CompareSettings& settings) {
    for (const auto& name : settings.metrics)
        if (!find_metric(name)) return unknown("metric", name, metric_rows());
    if (!settings.map.empty() && !find_map(settings.map))
        return unknown("error map", settings.map, map_rows());
    const auto wanted = [&](const std::string& name) {
        return settings.metrics.empty() || settings.metrics.count(name) > 0;
    };
    Comparison result;
    const auto add = [&](const std::string& name, auto&& measure) {
        if (wanted(name)) result.values.emplace_back(name, measure());
    };
    // FLIP computes its map anyway.
    const auto add_flip = [&](const char* name, auto&& measure) {
        const bool mapped = settings.map == name;
        if (!wanted(name) && !mapped) return;
        FlipResult flip = measure();
        if (wanted(name)) result.values.emplace_back(name, flip.mean);
        if (mapped) result.map = std::move(flip.map);
    };
    add_flip("flip", [&] { return flip(pair, settings.flip); });
    if (wanted("hdr_flip") || settings.map == "hdr_flip")
        result.exposures = settings.exposures
                               ? *settings.exposures
                               : exposure_range(pair.reference, settings.flip.tone_mapper);
    add_flip("hdr_flip", [&] { return hdr_flip(pair, result.exposures, settings.flip); });
    for (const MetricRow& row : metric_rows())
        if (row.measure) add(row.name, [&] { return row.measure(pair); });
    if (wanted("difference_p50") || wanted("difference_p95") || wanted("difference_p99") ||
        wanted("difference_max")) {
        const Percentiles p = difference_percentiles(pair);
        add("difference_p50", [&] { return p.p50; });
        add("difference_p95", [&] { return p.p95; });
        add("difference_p99", [&] { return p.p99; });
        add("difference_max", [&] { return p.max; });
    }
    if (settings.map == "relmse") result.map = relmse_map(pair);
    if (settings.map == "smape") result.map = smape_map(pair);
    if (settings.map == "difference") result.map = difference_map(pair);
    return result;
}

Values summary_of(const std::vector<Values>& frames) {
    Values summary;
    for (size_t i = 0; i < frames.front().size(); ++i) {
        const std::string& name = frames.front()[i].first;
        double sum = 0, largest = 0;
        size_t count = 0;
        for (const auto& values : frames)
            if (const auto& value = values[i].second) {
                sum += *value;
                largest = std::max(largest, *value);
                ++count;
            }
        std::optional<double> value;
        if (name == "nonfinite")
            value = sum;
        else if (name == "difference_max")
            value = largest;
        else if (count > 0)
            value = sum / double(count);
        summary.emplace_back(name, value);
    }
    return summary;
}

std::vector<std::pair<std::string, double>> metric_constants() {
    return {{"relmse_epsilon", kRelMseEpsilon},
            {"smape_epsilon", kSmapeEpsilon},
            {"trimmed_part", kTrimmedPart},
            {"display_gamma", kDisplayGamma},
            {"ssim_window_px", kSsimWindow},
            {"ssim_sigma_px", kSsimSigma},
            {"ssim_k1", kSsimK1},
            {"ssim_k2", kSsimK2},
            {"tone_target", kToneTarget},
            {"max_exposure_stops", kMaxExposureStops},
            {"region_sigma_px", kRegionSigma},
            {"min_energy", kMinEnergy},
            {"blurred_part", kBlurredPart},
            {"other_part", kOtherPart},
            {"least_region", kLeastRegion},
            {"energy_epsilon", kEnergyEpsilon},
            {"least_change", kLeastChange}};
}

Result<MetricLimit> parse_limit(const std::string& key, const std::string& text) {
    const size_t equals = text.find('=');
    MetricLimit limit{text.substr(0, equals), 0};
    const char* end = text.data() + text.size();
    const char* begin = equals == std::string::npos ? end : text.data() + equals + 1;
    const auto parsed = std::from_chars(begin, end, limit.value);
    if (parsed.ec != std::errc() || parsed.ptr != end || !std::isfinite(limit.value))
        return Status(StatusCode::usage,
                      setting(key) + ": '" + text + "' is not METRIC=NUMBER, e.g. flip=0.05");
    return limit;
}

std::string nonfinite_fault(const std::vector<MetricLimit>& limits, double pixels) {
    if (limits.empty() || !(pixels > 0)) return "";
    for (const auto& limit : limits)
        if (limit.metric == "nonfinite") return "";  // judged as the other metrics
    return concat("NaN or infinite pixels: ", pixels,
                  ", which every other metric reads as 0; mend the image, or allow them with "
                  "nonfinite=",
                  pixels);
}

}  // namespace postchain::metrics
