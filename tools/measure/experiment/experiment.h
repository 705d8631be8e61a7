// Shared by ab and bench: progress, and the metrics of one image.
#pragma once

#include <functional>
#include <map>
#include <optional>
#include <string>

#include "chain/gl/executor.h"
#include "tools/measure/experiment/settings.h"
#include "tools/measure/report/report.h"
#include "tools/metrics/compare.h"
#include "tools/sequence/settings/run_settings.h"

namespace postchain::experiment {

struct ExperimentProgress {
    std::string what;  // "frame 12, motion_blur.samples=9: metrics"
    size_t done = 0;
    size_t total = 0;
    double elapsed_s = 0;
    double remaining_s = 0;  // estimate; 0 if unknown
};
using ProgressCallback = std::function<void(const ExperimentProgress&)>;

// Counts units of work and extrapolates the remaining time from those done by this process.
class ProgressMeter {
  public:
    ProgressMeter(size_t total, size_t already_done, ProgressCallback callback);
    void at(const std::string& what);  // starts something; completes no unit
    void finished(size_t units = 1);

  private:
    void say();
    ProgressCallback callback_;
    ExperimentProgress progress_;
    size_t before_ = 0;
    double start_s_ = 0;
};

// Columns of a report, in order. Edges and sharpness need a ground truth; so do temporal errors in
// bench, whose converged images are not of consecutive frames.
std::vector<report::MetricInfo> metric_columns(report::Kind kind, bool with_truth);

// Values of one image by name in metric_columns(), without temporal errors, flicker and grid; its
// maps: kStoredMaps, and those averaged over tiles (relmse, smape, mse: means over RGB).
struct Measured {
    std::map<std::string, double> values;
    std::map<std::string, ImageF> maps;
};
// Error maps that a report stores; the page computes the others from pixels.
inline constexpr const char* kStoredMaps[] = {"hdr_flip", "flip"};
// `input`: the unfiltered image, for the regions of edges and sharpness; null = left out. `maps`:
// also compute maps other than kStoredMaps. Errors (input): different sizes.
Result<Measured> measure(const metrics::Pair& pair, const metrics::RgbImage* input,
                         const metrics::ExposureRange& exposures, const metrics::FlipSettings& flip,
                         bool maps);

// Values of report::Report::truth_noise for one frame. Errors (input): different sizes.
Result<std::map<std::string, double>> noise_of_truth(const metrics::RgbImage& truth,
                                                     const metrics::RgbImage& input);

// Mean of squared differences over pixels and RGB, in double; sizes must be equal.
template <class A, class B>
double mean_squared(const Image<A>& a, const Image<B>& b) {
    double sum = 0;
    for (size_t i = 0; i < a.pixels(); ++i) {
        for (size_t c = 0; c < 3; ++c) {
            const double d = double(a.data[i * size_t(a.channels) + c]) -
                             double(b.data[i * size_t(b.channels) + c]);
            sum += d * d;
        }
    }
    return a.pixels() ? sum / (3 * double(a.pixels())) : 0;
}

// Up to `count` of the frames, evenly spaced, starting with the first.
std::vector<int> spread_frames(const std::vector<int>& frames, int count);

// Whether the pass reads the row with the link's other values.
bool reads(const ChainLink& link, const Parameter& row);

// "motion_blur.seed 0" for every row that only changes random numbers, if the pass reads it.
std::vector<std::string> seeds_of(const Chain& chain);

// Adds a value to the series at a frame's index; means are over frames with a value.
void set_value(report::Metrics& metrics, const std::string& metric, size_t index, size_t frames,
               std::optional<double> value);
void find_means(report::Metrics& metrics);

// Regions for the page: in each kept frame, each variant's tile with the largest HDR-FLIP.
struct WorstTile {
    int frame = 0, x = 0, y = 0, width = 0, height = 0;
    double value = 0;  // mean of the map in the tile
};
WorstTile worst_tile(const ImageF& map, int frame, int tile_px);
inline constexpr int kCropPx = 96;
inline constexpr size_t kCrops = 6;
// The tiles with the largest errors over all variants, without overlap, at most `limit`.
std::vector<report::Crop> crops_of(std::vector<std::pair<WorstTile, std::string>> tiles,
                                   size_t limit = kCrops);

}  // namespace postchain::experiment
