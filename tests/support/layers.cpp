#include "tests/support/layers.h"

#include <algorithm>
#include <cmath>

namespace postchain::test {

TestFrame bright_frame(int width, int height) {
    TestFrame frame = layered_frame(width, height, {23.0f, -11.0f}, {-3.0f, 5.0f}, 5);
    ImageF& color = frame.planes.at(Role::color);
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
            const bool lamp = (x / 3 + y / 2) % 11 == 0, hole = (x + 2 * y) % 17 < 3;
            for (int c = 0; c < 4; ++c) {
                if (lamp && c < 3) color.at(x, y, c) *= 40;
                if (hole) color.at(x, y, c) *= 0.25f;
            }
        }
    frame.description = describe(frame.planes);
    frame.description.camera.f_stop = 0.2;
    return frame;
}

void add_motion_back(TestFrame& frame) {
    ImageF back = frame.planes.at(Role::motion);
    for (float& value : back.data) value = 0.75f * value + 1;
    frame.planes[Role::motion_back] = std::move(back);
    const FrameDescription described = describe(frame.planes);
    frame.description.planes = described.planes;
    frame.description.bounds = described.bounds;
}

void add_matte(TestFrame& frame, const ImageF& matte, size_t passes) {
    frame.planes[Role::mattes] = matte;
    frame.description.planes.add(Role::mattes);
    frame.description.mattes.assign(passes, 0);
    for (const Neighbor neighbor : kNeighbors) {
        if (!frame.planes.count(role_of(neighbor, Role::color))) continue;
        frame.planes[role_of(neighbor, Role::mattes)] = matte;
        frame.description.planes.add(role_of(neighbor, Role::mattes));
    }
}

ImageF square_matte(int width, int height, int soft_px) {
    ImageF matte(width, height, 1);
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
            const int out_x = std::max({width / 3 - x, x - (2 * width / 3 - 1), 0});
            const int out_y = std::max({height / 3 - y, y - (2 * height / 3 - 1), 0});
            const int out = std::max(out_x, out_y);
            matte.at(x, y) = out == 0 ? 1.0f : std::max(0.0f, 1 - float(out) / float(soft_px + 1));
        }
    return matte;
}

ImageF sum_of_layers(const ImageF& layers, int height) {
    ImageF sum(layers.width, height, 4);
    for (int i = 0; i < layers.height / height; ++i) {
        const ImageF layer = plane_of_stack(layers, i, height);
        for (size_t k = 0; k < sum.data.size(); ++k) sum.data[k] += layer.data[k];
    }
    return sum;
}

double relative_difference(const ImageF& a, const ImageF& b) {
    if (a.width != b.width || a.height != b.height || a.data.size() != b.data.size())
        return INFINITY;
    double scale = 1e-30, largest = 0;
    for (const float value : b.data) scale = std::max(scale, std::abs(double(value)));
    for (size_t i = 0; i < a.data.size(); ++i) {
        const double difference = std::abs(double(a.data[i]) - double(b.data[i]));
        if (!(difference <= largest)) largest = std::isnan(difference) ? INFINITY : difference;
    }
    return largest / scale;
}

}  // namespace postchain::test
