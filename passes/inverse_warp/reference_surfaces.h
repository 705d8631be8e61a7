// Surfaces of the inverse warp's double-precision reference: what is seen in each pixel of a frame,
// how it moves and how far out of focus it is. Written from docs/inverse_warp.md.
#pragma once

#include <vector>

#include "passes/inverse_warp/inverse_warp.h"

namespace postchain::inverse_warp::reference {

struct Vec {
    double x = 0, y = 0;
};
inline Vec operator+(Vec a, Vec b) {
    return {a.x + b.x, a.y + b.y};
}
inline Vec operator-(Vec a, Vec b) {
    return {a.x - b.x, a.y - b.y};
}
inline Vec operator*(double s, Vec v) {
    return {s * v.x, s * v.y};
}
inline double dot(Vec a, Vec b) {
    return a.x * b.x + a.y * b.y;
}

// One instant, u in [-1, 1], and one point of the lens. Inverse depths within the ratio `one_depth`
// are one; `weight`: part of a sample.
struct Sample {
    double u = 0;
    Vec lens;
    double one_depth = 1, weight = 1;
    int number = 0;  // in its set
};

// Pixels; a and b are 0 without motion, the radius is without a lens.
struct Surface {
    Vec a, b;
    double straight = 0;
    double inverse_depth = 0;
    double radius = 0;
    bool edge = false;

    // Longest path on either side of the frame.
    double path() const;
    // Displacement; h: half the open time, frames.
    Vec at(const Sample& sample, double h) const;
};

// Inverse depths up to this ratio are one surface.
inline constexpr double kOneDepth = 1.05;
bool one_depth(double q, double r);

// Planes of this frame or of a neighbor; null: there is none.
struct Planes {
    const ImageD* inverse_depth = nullptr;
    const ImageD* motion = nullptr;
    const ImageD* motion_back = nullptr;
    bool of_neighbor = false;
};

// Of a neighbor's pixel whose inverse depth is below 0: nothing is found there.
inline constexpr double kNotThere = -2;

// Row by row, as their texture stores them: a in 32 bits, b in steps of 1/64 px, the inverse depth
// without its last 8 bits, w in 7 bits.
std::vector<Surface> surfaces_of(const Planes& planes, const Settings& settings);

// Displacements of what is open, shutter or lens: squared, px^2; of two from each other, squared,
// px^2; the longest, px.
double displaced(const Surface& s, const Settings& settings);
double apart(const Surface& s, const Surface& t, const Settings& settings);
double longest(const Surface& s, const Settings& settings);

// Of the color of a pixel: all four values are finite; the largest of red, green and blue.
bool finite(const double* rgba);
double largest(const double* rgb);

// Half the open time, frames: 1 without a shutter.
double half_open_of(const Settings& settings);

}  // namespace postchain::inverse_warp::reference
