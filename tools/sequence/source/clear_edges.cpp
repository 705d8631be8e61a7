#include "tools/sequence/source/clear_edges.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <vector>

namespace postchain::sequence {
namespace {

constexpr int kReachPx = kClearEdgeRows;  // a thin wire is hit by few of its pixels' samples

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

uint64_t fill_clear_edges(FramePlanes& planes, const Strip& strip) {
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
    return uint64_t(std::count_if(changes.begin(), changes.end(), [&](const Change& change) {
        return change.y + strip.top >= strip.first && change.y + strip.top < strip.end;
    }));
}

}  // namespace postchain::sequence
