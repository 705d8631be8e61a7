// Sums over a pixel's samples in the inverse warp's double-precision reference (accumulate.glsl,
// adaptive.glsl). Written from docs/inverse_warp.md.
#pragma once

#include <array>

#include "passes/inverse_warp/reference_search.h"

namespace postchain::inverse_warp::reference {

// A sample's color, and the surface that it sees.
struct Seen {
    Color color;
    double inverse_depth = 0;
    Vec path;  // a
    Vec at;    // where this frame shows or hides it, px
};

// Samples of blurred surfaces.
struct Soft {
    Color color;
    double weight = 0;
    std::array<double, 3> spread = {};  // sum of covariances: xx, xy, yy, px^2
};

// Half of a pixel's samples.
struct Half {
    std::array<double, 3> color = {};
    double weight = 0;
};

// Colors are differences to the pixel's own.
struct Sums {
    Color color;
    double weight = 0;
    double moment = 0;  // of the displacements, px^2
    Soft soft;
    std::array<Half, 2> halves;
};

Sums no_samples(int channels);

void accumulate(Sums& sums, const Pixel& pixel, const Sample& now, const Seen& seen,
                const Settings& settings);

// Squared difference between the means of the two halves of a pixel's samples, as shown: mean of
// red, green and blue; 0 if a half is empty.
double noise_of(const std::array<Half, 2>& halves, const double* own);

// Weight of each sample beyond the first `samples` of a block, whose pixels have this mean noise.
double weight_of_more(double noise, int samples);

}  // namespace postchain::inverse_warp::reference
