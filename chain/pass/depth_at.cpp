#include "chain/pass/depth_at.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace postchain {

double inverse_depth_at(const ImageF& inverse_depth, const FrameDescription& frame, Place place) {
    constexpr int kAround = 2;
    const auto pixel = [](double fraction, int display, int origin, int size) {
        const double at = std::floor(fraction * display) - origin;
        return int(std::clamp(at, 0.0, size - 1.0));
    };
    const int width = inverse_depth.width, height = inverse_depth.height;
    const int x = pixel(place[0], frame.display_width, frame.origin_x, width);
    const int y = pixel(place[1], frame.display_height, frame.origin_y, height);
    std::vector<float> around;
    for (int j = std::max(y - kAround, 0); j <= std::min(y + kAround, height - 1); ++j)
        for (int i = std::max(x - kAround, 0); i <= std::min(x + kAround, width - 1); ++i)
            if (const float w = inverse_depth.at(i, j); std::isfinite(w))
                around.push_back(std::max(w, 0.0f));
    if (around.empty()) return 0;
    const auto middle = around.begin() + std::ptrdiff_t(around.size() / 2);
    std::nth_element(around.begin(), middle, around.end());
    return *middle;
}

void find_depths(const Chain& chain, const PlaneView& planes, FrameDescription& frame) {
    const ImageF* plane = planes.find(Role::inverse_depth);
    if (!plane) return;
    for (const ChainLink& link : chain.links)
        for (const Place& place : link.pass->depth_places())
            frame.bounds.inverse_depth_at[place] = inverse_depth_at(*plane, frame, place);
}

}  // namespace postchain
