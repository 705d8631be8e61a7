// The filters of FLIP as one-dimensional kernels: every filter of the paper is a sum of separable
// ones, so that a picture is filtered along rows, then along columns, exactly as by the 2-D ones.
//
// Andersson, Nilsson, Akenine-Moeller, Oskarsson, Astroem, Fairchild, "FLIP: A Difference Evaluator
// for Alternating Images", HPG 2020: table 1 and equations 5 (contrast sensitivity), section 3.4
// (edges and points).
#pragma once

#include <vector>

namespace postchain::metrics {

// Odd length, center in the middle; a picture is correlated with it.
struct Kernel {
    std::vector<float> taps;
    int radius() const { return int(taps.size() / 2); }
};

struct FlipKernels {
    Kernel achromatic;           // along rows and columns
    Kernel red_green;            // along rows and columns
    Kernel blue_yellow_rows[2];  // the channel's two Gaussians; results are added
    Kernel blue_yellow_columns[2];
    Kernel gaussian;  // across the direction of a derivative
    Kernel first;     // edges: first derivative, negative and positive parts sum to 1
    Kernel second;    // points: second derivative, the same
    int radius = 0;   // the largest
};

// pixels_per_degree in kMinPixelsPerDegree..kMaxPixelsPerDegree (flip.h).
FlipKernels flip_kernels(double pixels_per_degree);

}  // namespace postchain::metrics
