#include "tools/sequence/source/surface_edges.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <vector>

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
MixedEdgeCounts::Count count_mixed(const ImageF& plane) {
    const auto at = [&](int x, int y) {
        std::array<double, N> value;
        for (size_t i = 0; i < N; ++i) value[i] = double(plane.at(x, y, int(i)));
        return value;
    };
    MixedEdgeCounts::Count count;
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
    return count;
}

}  // namespace

MixedEdgeCounts count_mixed_edges(const FramePlanes& planes) {
    MixedEdgeCounts found;
    if (const auto depth = planes.find(Role::inverse_depth); depth != planes.end())
        found.depth = count_mixed<1>(depth->second);
    if (const auto motion = planes.find(Role::motion); motion != planes.end())
        found.motion = count_mixed<2>(motion->second);
    return found;
}

namespace {

constexpr int kReachPx = 3;  // a thin wire is hit by few of its pixels' samples

struct Change {
    int x, y, from_x, from_y;
};

// The pixel with the largest alpha among the surface pixels at this distance; false if none.
bool find_surface(const ImageF& color, const ImageF& depth, int distance, Change& change) {
    float most = 0;
    for (int j = -distance; j <= distance; ++j) {
        for (int i = -distance; i <= distance; ++i) {
            if (std::max(std::abs(i), std::abs(j)) != distance) continue;
            const int x = change.x + i, y = change.y + j;
            if (x < 0 || y < 0 || x >= depth.width || y >= depth.height) continue;
            if (is_infinitely_far(depth.at(x, y)) || color.at(x, y, 3) <= most) continue;
            most = color.at(x, y, 3);
            change.from_x = x;
            change.from_y = y;
        }
    }
    return most > 0;
}

}  // namespace

uint64_t fill_clear_edges(FramePlanes& planes) {
    const auto color = planes.find(Role::color), depth = planes.find(Role::inverse_depth);
    if (color == planes.end() || depth == planes.end()) return 0;
    std::vector<Change> changes;
    for (int y = 0; y < depth->second.height; ++y) {
        for (int x = 0; x < depth->second.width; ++x) {
            const float alpha = color->second.at(x, y, 3);
            if (!(alpha > 0 && alpha < 1) || !is_infinitely_far(depth->second.at(x, y))) continue;
            Change change{x, y, x, y};
            for (int distance = 1; distance <= kReachPx; ++distance) {
                if (!find_surface(color->second, depth->second, distance, change)) continue;
                changes.push_back(change);
                break;
            }
        }
    }
    for (Role role : {Role::inverse_depth, Role::motion, Role::motion_back}) {
        const auto plane = planes.find(role);
        if (plane == planes.end()) continue;
        for (const Change& change : changes)
            std::copy_n(plane->second.pixel(change.from_x, change.from_y), plane->second.channels,
                        plane->second.pixel(change.x, change.y));
    }
    return changes.size();
}

}  // namespace postchain::sequence
