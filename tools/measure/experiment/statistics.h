// Statistics of the difference between two variants: paired t-interval over frames, bootstrap over
// tiles within frames, medians of times.
//
// t: Student, Biometrika 6(1), 1908. Bootstrap: Efron, Annals of Statistics 7(1), 1979, percentile
// interval. Tiles are drawn within each frame, so the interval holds only for these frames.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "chain/base/image.h"
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
    double error = 0;                          // standard error of the mean, s / sqrt(n)
    std::optional<report::Interval> interval;  // mean -+ t error; empty below two values
};
Paired paired_interval(const std::vector<double>& differences);

// Needs two values. Two-sided probability of a mean at least as far from 0 if the true mean is 0.
double difference_probability(const Paired& paired);
// Two one-sided tests (Schuirmann, J. Pharmacokinetics and Biopharmaceutics 15(6), 1987): the
// larger probability of such a mean if the true one is -margin or margin, or beyond. Needs two
// values.
double equivalence_probability(const Paired& paired, double margin);
// Probabilities corrected for their number, in the same order (Holm, Scandinavian Journal of
// Statistics 6(2), 1979): if each below p is claimed, the probability of a false claim is below p.
std::vector<double> holm(const std::vector<double>& probabilities);

// Two-sided probability of at most min(positive, negative) of one sign in fair coin throws.
double sign_probability(int positive, int negative);
// 95 % interval of the share of `successes` in n > 0 throws (Clopper, Pearson, Biometrika 26(4),
// 1934).
report::Interval share_interval(int successes, int n);

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
