#include "tools/sequence/run/edge_check.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace postchain::sequence {
namespace {

constexpr int kEveryRow = 4;
constexpr double kDepthJump = 1.05;  // ratio of inverse depths
constexpr double kMotionJumpPx = 1;
constexpr double kShare = 0.25;  // of the way between the two sides
constexpr double kFlat = 0.1;    // of the same: slope of a side

struct Count {
    uint64_t edges = 0, mixed = 0;
    double part() const { return edges > 0 ? double(mixed) / double(edges) : 0; }
};

// Values of a pixel and of the two on either side of it. How far along the way from a to b it is,
// and how far aside, as parts of that way.
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

bool differ(const std::array<double, 1>& a, const std::array<double, 1>& b) {
    return std::max(a[0], b[0]) > kDepthJump * std::min(a[0], b[0]);
}

bool differ(const std::array<double, 2>& a, const std::array<double, 2>& b) {
    return std::hypot(a[0] - b[0], a[1] - b[1]) > kMotionJumpPx;
}

template <size_t N>
double squared(const std::array<double, N>& a, const std::array<double, N>& b) {
    double sum = 0;
    for (size_t i = 0; i < N; ++i) sum += (a[i] - b[i]) * (a[i] - b[i]);
    return sum;
}

template <size_t N>
double mixed_part(const ImageF& plane) {
    const auto at = [&](int x, int y) {
        std::array<double, N> value;
        for (size_t i = 0; i < N; ++i) value[i] = double(plane.at(x, y, int(i)));
        return value;
    };
    Count count;
    for (int y = 2; y + 2 < plane.height; y += kEveryRow) {
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
    return count.part();
}

}  // namespace

MixedEdges find_mixed_edges(const FramePlanes& planes) {
    MixedEdges found;
    if (const auto depth = planes.find(Role::inverse_depth); depth != planes.end())
        found.depth = mixed_part<1>(depth->second);
    if (const auto motion = planes.find(Role::motion); motion != planes.end())
        found.motion = mixed_part<2>(motion->second);
    return found;
}

}  // namespace postchain::sequence
