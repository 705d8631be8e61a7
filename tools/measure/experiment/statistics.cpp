#include "tools/measure/experiment/statistics.h"

#include <algorithm>
// Doubles are exact enough. Under valgrind, which has no long double, its tables overflow.
#define BOOST_MATH_PROMOTE_DOUBLE_POLICY false
#include <boost/math/distributions/binomial.hpp>
#include <boost/math/distributions/students_t.hpp>
#include <cassert>
#include <cmath>
#include <numeric>

namespace postchain::experiment {
namespace {

// Steele, Lea, Flood, "Fast splittable pseudorandom number generators", OOPSLA 2014.
uint64_t split_mix(uint64_t& state) {
    uint64_t z = (state += 0x9e3779b97f4a7c15ull);
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ull;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebull;
    return z ^ (z >> 31);
}

// Quantile `part` of sorted values, with linear interpolation between ranks.
double quantile(const std::vector<double>& sorted, double part) {
    const double rank = part * double(sorted.size() - 1);
    const auto below = size_t(rank);
    const size_t above = std::min(below + 1, sorted.size() - 1);
    return sorted[below] + (rank - double(below)) * (sorted[above] - sorted[below]);
}

}  // namespace

double t_cumulative(double t, int degrees) {
    return cdf(boost::math::students_t(degrees), t);
}

double t_quantile(double p, int degrees) {
    return quantile(boost::math::students_t(degrees), p);
}

Paired paired_interval(const std::vector<double>& differences) {
    Paired paired;
    paired.n = int(differences.size());
    if (paired.n == 0) return paired;
    for (double d : differences) paired.mean += d / paired.n;
    if (paired.n < 2) return paired;
    double squares = 0;
    for (double d : differences) squares += (d - paired.mean) * (d - paired.mean);
    paired.error = std::sqrt(squares / (paired.n - 1) / paired.n);
    const double half = t_quantile(0.5 + kConfidence / 2, paired.n - 1) * paired.error;
    paired.interval = report::Interval{paired.mean - half, paired.mean + half};
    return paired;
}

namespace {

// Probability of t >= distance / error. Equal differences have no error.
double tail(double distance, const Paired& paired) {
    assert(paired.n >= 2);
    if (paired.error == 0) return distance > 0 ? 0 : distance < 0 ? 1 : 0.5;
    return t_cumulative(-distance / paired.error, paired.n - 1);
}

}  // namespace

double difference_probability(const Paired& paired) {
    return std::min(1.0, 2 * tail(std::abs(paired.mean), paired));
}

double equivalence_probability(const Paired& paired, double margin) {
    return tail(margin - std::abs(paired.mean), paired);
}

std::vector<double> holm(const std::vector<double>& probabilities) {
    const size_t count = probabilities.size();
    std::vector<size_t> order(count);
    std::iota(order.begin(), order.end(), size_t(0));
    std::ranges::stable_sort(order, {}, [&](size_t i) { return probabilities[i]; });
    std::vector<double> corrected(count);
    double largest = 0;
    for (size_t i = 0; i < count; ++i) {
        largest = std::max(largest, double(count - i) * probabilities[order[i]]);
        corrected[order[i]] = std::min(1.0, largest);
    }
    return corrected;
}

double sign_probability(int positive, int negative) {
    const boost::math::binomial fair(positive + negative, 0.5);
    return std::min(1.0, 2 * cdf(fair, std::min(positive, negative)));
}

report::Interval share_interval(int successes, int n) {
    using boost::math::binomial;
    const double tail = (1 - kConfidence) / 2;
    return {binomial::find_lower_bound_on_p(n, successes, tail),
            binomial::find_upper_bound_on_p(n, successes, tail)};
}

TileSums tile_sums(const ImageF& a, const ImageF& b, int tile_px) {
    assert(a.width == b.width && a.height == b.height && a.channels == 1 && b.channels == 1);
    const int across = (a.width + tile_px - 1) / tile_px;
    const int down = (a.height + tile_px - 1) / tile_px;
    TileSums tiles;
    tiles.sums.assign(size_t(across) * size_t(down), 0);
    tiles.pixels = tiles.sums;
    for (int y = 0; y < a.height; ++y) {
        for (int x = 0; x < a.width; ++x) {
            const size_t tile = size_t(y / tile_px) * size_t(across) + size_t(x / tile_px);
            tiles.sums[tile] += double(b.at(x, y)) - double(a.at(x, y));
            tiles.pixels[tile] += 1;
        }
    }
    return tiles;
}

TileBootstrap::TileBootstrap(uint64_t seed, int replicates)
    : seed_(seed), replicates_(size_t(replicates), 0) {}

void TileBootstrap::add(int frame, const TileSums& tiles) {
    const size_t n = tiles.sums.size();
    if (n == 0) return;
    for (size_t r = 0; r < replicates_.size(); ++r) {
        uint64_t start = seed_;
        uint64_t state = split_mix(start) ^ (uint64_t(uint32_t(frame)) << 32 | uint64_t(r));
        state = split_mix(state);
        double sum = 0, pixels = 0;
        for (size_t i = 0; i < n; ++i) {
            // The top 32 bits as a fraction of n: bias below n / 2^32.
            const size_t drawn = size_t(((split_mix(state) >> 32) * uint64_t(n)) >> 32);
            sum += tiles.sums[drawn];
            pixels += tiles.pixels[drawn];
        }
        replicates_[r] += sum / pixels;
    }
    ++frames_;
    tiles_ += int(n);
}

std::optional<report::Interval> TileBootstrap::interval() const {
    if (frames_ == 0 || replicates_.empty()) return std::nullopt;
    std::vector<double> sorted = replicates_;
    std::ranges::sort(sorted);
    const double tail = (1 - kConfidence) / 2;
    return report::Interval{quantile(sorted, tail) / frames_, quantile(sorted, 1 - tail) / frames_};
}

report::TimeFigure time_figure(std::vector<double> milliseconds) {
    std::ranges::sort(milliseconds);
    report::TimeFigure figure;
    figure.n = int(milliseconds.size());
    figure.median_ms = quantile(milliseconds, 0.5);
    figure.spread_ms = quantile(milliseconds, 0.75) - quantile(milliseconds, 0.25);
    return figure;
}

}  // namespace postchain::experiment
