#include "tools/sequence/source/edge_check.h"

#include <algorithm>
#include <array>

namespace postchain::sequence {
namespace {

constexpr int kEveryRow = 4;
constexpr double kDepthJump = 1.05;  // ratio of inverse depths
constexpr double kMotionJumpPx = 1;
constexpr double kShare = 0.25;  // minimum distance from each side, as a fraction of the difference
constexpr double kFlat = 0.1;    // maximum slope of a side, in the same unit

// Values of a pixel and of the two pixels on either side. Position along and distance from the line
// from a to b, as fractions of its length.
template <size_t N>
bool between(const std::array<double, N>& a, const std::array<double, N>& p,
             const std::array<double, N>& b) {
    double way = 0, along = 0;
    for (size_t i = 0; i < N; ++i) {
        way += (b[i] - a[i]) * (b[i] - a[i]);
        along += (b[i] - a[i]) * (p[i] - a[i]);
    }
    const double share = along / way;
    double aside = 0;
    for (size_t i = 0; i < N; ++i) {
        const double off = p[i] - a[i] - share * (b[i] - a[i]);
        aside += off * off;
    }
    return share > kShare && share < 1 - kShare && aside < kShare * kShare * way;
}

template <size_t N>
double squared(const std::array<double, N>& a, const std::array<double, N>& b) {
    double sum = 0;
    for (size_t i = 0; i < N; ++i) sum += (a[i] - b[i]) * (a[i] - b[i]);
    return sum;
}

bool differ(const std::array<double, 1>& a, const std::array<double, 1>& b) {
    return std::max(a[0], b[0]) > kDepthJump * std::min(a[0], b[0]);
}

bool differ(const std::array<double, 2>& a, const std::array<double, 2>& b) {
    return squared(a, b) > kMotionJumpPx * kMotionJumpPx;
}

template <size_t N>
MixedEdgeCounts::Count count_mixed(const ImageF& plane, const Strip& strip) {
    const auto at = [&](int x, int y) {
        std::array<double, N> value;
        for (size_t i = 0; i < N; ++i) value[i] = double(plane.at(x, y - strip.top, int(i)));
        return value;
    };
    MixedEdgeCounts::Count count;
    for (int y = std::max(strip.first, 2); y < std::min(strip.end, strip.height - 2); ++y) {
        if ((y - 2) % kEveryRow != 0) continue;
        for (int x = 2; x + 2 < plane.width; ++x) {
            bool edge = false, mixed = false;
            for (const auto& [i, j] : {std::pair{1, 0}, std::pair{0, 1}}) {
                const auto a = at(x - i, y - j), b = at(x + i, y + j);
                if (!differ(a, b)) continue;
                const double slope = std::max(squared(a, at(x - 2 * i, y - 2 * j)),
                                              squared(b, at(x + 2 * i, y + 2 * j)));
                if (slope > kFlat * kFlat * squared(a, b)) continue;
                edge = true;
                mixed = mixed || between(a, at(x, y), b);
            }
            count.edges += edge;
            count.mixed += mixed;
        }
    }
    return count;
}

}  // namespace

MixedEdgeCounts count_mixed_edges(const FramePlanes& planes, const Strip& strip) {
    MixedEdgeCounts found;
    if (const auto depth = planes.find(Role::inverse_depth); depth != planes.end())
        found.depth = count_mixed<1>(depth->second, strip);
    if (const auto motion = planes.find(Role::motion); motion != planes.end())
        found.motion = count_mixed<2>(motion->second, strip);
    return found;
}

}  // namespace postchain::sequence
