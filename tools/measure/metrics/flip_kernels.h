// The filters of FLIP as one-dimensional kernels. Every filter of the paper is a sum of separable
// ones, so filtering along rows and then columns is exact.
//
// Andersson, Nilsson, Akenine-Moeller, Oskarsson, Astroem, Fairchild, "FLIP: A Difference Evaluator
// for Alternating Images", HPG 2020: table 1 and equations 5 (contrast sensitivity), section 3.4
// (edges and points).
#pragma once

#include <vector>

namespace postchain::metrics {

// Odd length, centered; applied by correlation.
struct Kernel {
    std::vector<float> taps;
    int radius() const { return int(taps.size() / 2); }
};

struct FlipKernels {
    Kernel achromatic;           // along rows and columns
    Kernel red_green;            // along rows and columns
    Kernel blue_yellow_rows[2];  // the channel's two Gaussians, to be summed
    Kernel blue_yellow_columns[2];
    Kernel gaussian;  // across the direction of a derivative
    Kernel first;     // edges: first derivative, negative and positive parts sum to 1
    Kernel second;    // points: second derivative, same normalization
    int radius = 0;   // the largest of all kernels
};

// pixels_per_degree in kMinPixelsPerDegree..kMaxPixelsPerDegree (flip.h).
FlipKernels flip_kernels(double pixels_per_degree);

}  // namespace postchain::metrics
