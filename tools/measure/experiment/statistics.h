// Statistics of the difference between two variants: paired t-interval over frames, bootstrap over
// tiles within frames, medians of times.
//
// t: Student, Biometrika 6(1), 1908. Bootstrap: Efron, Annals of Statistics 7(1), 1979, percentile
// interval. Tiles are drawn within each frame, so the interval holds only for these frames.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "chain/image.h"
#include "tools/measure/report/report.h"

namespace postchain::experiment {

inline constexpr double kConfidence = 0.95;
inline constexpr int kFewFrames = 8;  // with fewer frames, no decision is made

// Cumulative distribution of Student's t, and its inverse for 0 < p < 1; degrees >= 1.
double t_cumulative(double t, int degrees);
double t_quantile(double p, int degrees);

struct Paired {
    int n = 0;
    double mean = 0;
    std::optional<report::Interval> interval;  // mean -+ t s / sqrt(n); empty below two values
};
Paired paired_interval(const std::vector<double>& differences);

// Difference of two error maps, summed over square tiles.
struct TileSums {
    std::vector<double> sums;
    std::vector<double> pixels;  // per tile; border tiles may be smaller
};
TileSums tile_sums(const ImageF& a, const ImageF& b, int tile_px);  // b - a, one channel each

// Mean over frames of the difference, with each frame's tiles redrawn with replacement. Draws
// depend only on seed, frame and replicate, so they are the same for every metric.
class TileBootstrap {
  public:
    TileBootstrap(uint64_t seed, int replicates);
    void add(int frame, const TileSums& tiles);
    int frames() const { return frames_; }
    int tiles() const { return tiles_; }               // drawn per replicate
    std::optional<report::Interval> interval() const;  // 2.5 % to 97.5 % of the replicates

  private:
    uint64_t seed_;
    std::vector<double> replicates_;  // sums over frames
    int frames_ = 0;
    int tiles_ = 0;
};

// Median and quartiles with linear interpolation between ranks. Needs at least one value.
report::TimeFigure time_figure(std::vector<double> milliseconds);

}  // namespace postchain::experiment
