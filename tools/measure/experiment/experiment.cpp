#include "tools/measure/experiment/experiment.h"

#include <algorithm>
#include <chrono>

#include "tools/measure/experiment/temporal_stability.h"
#include "tools/measure/report/words.h"
#include "tools/metrics/noise.h"
#include "tools/metrics/sharpness.h"
#include "tools/metrics/temporal.h"

namespace postchain::experiment {
namespace {

double now_s() {
    return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch())
        .count();
}

ImageF squared_map(const metrics::Pair& pair) {
    ImageF map(pair.width(), pair.height(), 1);
    for (size_t i = 0; i < pair.pixels(); ++i) {
        double sum = 0;
        for (int c = 0; c < 3; ++c) {
            const double d = double(pair.test_pixel(i)[c]) - double(pair.reference_pixel(i)[c]);
            sum += d * d;
        }
        map.data[i] = float(sum / 3);
    }
    return map;
}

}  // namespace

ProgressMeter::ProgressMeter(size_t total, size_t already_done, ProgressCallback callback)
    : callback_(std::move(callback)), before_(already_done), start_s_(now_s()) {
    progress_.total = total;
    progress_.done = already_done;
}

void ProgressMeter::at(const std::string& what) {
    progress_.what = what;
    say();
}

void ProgressMeter::finished(size_t units) {
    progress_.done += units;
    say();
}

void ProgressMeter::say() {
    progress_.elapsed_s = now_s() - start_s_;
    const size_t here = progress_.done - before_;
    progress_.remaining_s =
        here == 0 || progress_.done >= progress_.total
            ? 0
            : progress_.elapsed_s / double(here) * double(progress_.total - progress_.done);
    if (callback_) callback_(progress_);
}

std::vector<report::MetricInfo> metric_columns(report::Kind kind, bool with_truth) {
    std::vector<report::MetricInfo> columns;
    for (const auto& row : metrics::metric_rows())
        columns.push_back(
            {row.name, row.help, row.is_error ? report::Better::lower : report::Better::higher});
    if (kind == report::Kind::ab || with_truth)
        for (const auto* rows : {&metrics::temporal_rows(), &metrics::temporal_class_rows()})
            for (const auto& row : *rows)
                columns.push_back({row.name, row.help, report::Better::lower});
    const std::string where = concat(" (up to ", kStabilityFrames, " frames)");
    columns.push_back({"flicker",
                       concat("standard deviation over ", kFlickerSeeds,
                              " seeds of one frame, mean over pixels", where),
                       report::Better::lower});
    columns.push_back({"grid",
                       concat("mean of |F(shift(I)) - shift(F(I))| over up to ", kGridShifts,
                              " shifts within a tile, noise included", where),
                       report::Better::lower});
    if (!with_truth) return columns;
    columns.push_back({"edges_in_blurred",
                       "gradient energy where the ground truth is blurred, relative to it",
                       report::Better::one});
    columns.push_back({"sharpness_in_focus",
                       "gradient energy where the ground truth is sharp, relative to it",
                       report::Better::one});
    return columns;
}

Result<Measured> measure(const metrics::Pair& pair, const metrics::RgbImage* input,
                         const metrics::ExposureRange& exposures, const metrics::FlipSettings& flip,
                         bool maps) {
    Measured measured;
    metrics::CompareSettings settings;
    settings.flip = flip;
    settings.exposures = exposures;
    settings.map = "hdr_flip";
    for (const auto& row : metrics::metric_rows())
        if (row.name != "flip") settings.metrics.insert(row.name);
    ASSIGN_OR_RETURN(auto most, metrics::compare(pair, settings));
    for (const auto& [name, value] : most.values)
        if (value) measured.values[name] = *value;
    measured.maps["hdr_flip"] = std::move(most.map);
    metrics::FlipResult ldr = metrics::flip(pair, flip);
    measured.values["flip"] = ldr.mean;
    measured.maps["flip"] = std::move(ldr.map);
    if (input) {
        ASSIGN_OR_RETURN(auto sharp, metrics::sharpness(pair, *input));
        if (sharp.edges_in_blurred) measured.values["edges_in_blurred"] = *sharp.edges_in_blurred;
        if (sharp.sharpness_in_focus)
            measured.values["sharpness_in_focus"] = *sharp.sharpness_in_focus;
    }
    if (!maps) return measured;
    measured.maps["relmse"] = metrics::relmse_map(pair);
    measured.maps["smape"] = metrics::smape_map(pair);
    measured.maps["mse"] = squared_map(pair);
    return measured;
}

Result<std::map<std::string, double>> noise_of_truth(const metrics::RgbImage& truth,
                                                     const metrics::RgbImage& input) {
    ASSIGN_OR_RETURN(auto noise, metrics::truth_noise(truth, input));
    std::map<std::string, double> values = std::move(noise.of_no_error);
    values[report::kNoiseSigma] = noise.sigma;
    return values;
}

std::vector<int> spread_frames(const std::vector<int>& frames, int count) {
    if (count <= 0 || frames.empty()) return {};
    const size_t n = frames.size(), k = std::min(n, size_t(count));
    std::vector<int> chosen;
    for (size_t i = 0; i < k; ++i) chosen.push_back(frames[k == 1 ? 0 : i * (n - 1) / (k - 1)]);
    return chosen;
}

bool reads(const ChainLink& link, const Parameter& row) {
    return link.type->parameters->unread(row, link.pass->parameters()).empty();
}

std::vector<std::string> seeds_of(const Chain& chain) {
    std::vector<std::string> seeds;
    for (size_t i = 0; i < chain.links.size(); ++i) {
        const auto& link = chain.links[i];
        for (const Parameter& row : link.type->parameters->rows())
            if (row.convergence == Convergence::averaged && reads(link, row))
                seeds.push_back(concat("passes[", i, "].", link.type->name, ".", row.key, " ",
                                       text_of(row.get(link.pass->parameters()))));
    }
    return seeds;
}

void set_value(report::Metrics& metrics, const std::string& metric, size_t index, size_t frames,
               std::optional<double> value) {
    auto& series = metrics[metric].frames;
    series.resize(frames);
    series[index] = value;
}

void find_means(report::Metrics& metrics) {
    for (auto& [name, series] : metrics) {
        double sum = 0;
        int count = 0;
        for (const auto& value : series.frames) {
            if (!value) continue;
            sum += *value;
            ++count;
        }
        series.mean.reset();
        if (count) series.mean = sum / count;
    }
}

WorstTile worst_tile(const ImageF& map, int frame, int tile_px) {
    WorstTile worst;
    worst.frame = frame;
    worst.value = -1;
    for (int top = 0; top < map.height; top += tile_px) {
        for (int left = 0; left < map.width; left += tile_px) {
            const int right = std::min(left + tile_px, map.width);
            const int bottom = std::min(top + tile_px, map.height);
            double sum = 0;
            for (int y = top; y < bottom; ++y)
                for (int x = left; x < right; ++x) sum += double(map.at(x, y));
            const double mean = sum / (double(right - left) * double(bottom - top));
            if (mean > worst.value) worst = {frame, left, top, right - left, bottom - top, mean};
        }
    }
    return worst;
}

std::vector<report::Crop> crops_of(std::vector<std::pair<WorstTile, std::string>> tiles,
                                   size_t limit) {
    std::ranges::stable_sort(
        tiles, [](const auto& a, const auto& b) { return a.first.value > b.first.value; });
    std::vector<report::Crop> crops;
    for (const auto& [tile, why] : tiles) {
        const bool known = std::ranges::any_of(crops, [&, &t = tile](const report::Crop& c) {
            return c.frame == t.frame && c.x == t.x && c.y == t.y;
        });
        if (known || crops.size() >= limit) continue;
        crops.push_back({tile.frame, tile.x, tile.y, tile.width, tile.height,
                         concat(why, ": mean HDR-FLIP ", report::figure(tile.value, 3))});
    }
    return crops;
}

}  // namespace postchain::experiment
