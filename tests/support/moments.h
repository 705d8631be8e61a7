// How light spreads in an image.
#pragma once

#include "chain/base/image.h"

namespace postchain::test {

// Sum of the red channel, its mean place from x0, y0, and its second moments about x0, y0, px^2.
struct Moments {
    double light = 0, x = 0, y = 0, xx = 0, yy = 0;
};

inline Moments moments_of(const ImageF& image, double x0, double y0) {
    Moments m;
    for (int y = 0; y < image.height; ++y)
        for (int x = 0; x < image.width; ++x) {
            const double value = image.at(x, y), dx = x - x0, dy = y - y0;
            m.light += value;
            m.x += value * dx, m.y += value * dy;
            m.xx += value * dx * dx, m.yy += value * dy * dy;
        }
    for (double* sum : {&m.x, &m.y, &m.xx, &m.yy}) *sum /= m.light;
    return m;
}

}  // namespace postchain::test
