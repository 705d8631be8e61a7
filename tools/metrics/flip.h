// FLIP and HDR-FLIP: the difference seen when flipping between two images, 0..1 per pixel.
//
// FLIP:     Andersson, Nilsson, Akenine-Moeller, Oskarsson, Astroem, Fairchild, HPG 2020.
// HDR-FLIP: Andersson, Nilsson, Shirley, Akenine-Moeller, Eurographics Short Papers 2021.
//
//   linear RGB --opponent--> contrast sensitivity --Lab, Hunt, HyAB--> color difference  \  dE =
//             `--luminance--> edges, points -------------------------> feature difference / c^(1-f)
//   HDR-FLIP: for each exposure tone map, clamp, FLIP; the maximum per pixel.
//
// Deviations: input is linear (the published tools decode sRGB first); values are clamped to 0
// before tone mapping (the rational curves have poles below 0); the feature difference is at most
// 1; sums are in double. At image borders the edge is replicated.
#pragma once

#include "tools/metrics/exposure.h"
#include "tools/metrics/pair.h"

namespace postchain::metrics {

// A monitor 3840 pixels and 0.7 m wide, seen from 0.7 m.
inline constexpr double kPixelsPerDegree = 67.02;
inline constexpr double kMinPixelsPerDegree = 1;  // kernels of a pixel
inline constexpr double kMaxPixelsPerDegree = 1000;

struct FlipSettings {
    double pixels_per_degree = kPixelsPerDegree;  // within the limits above
    ToneMapper tone_mapper = ToneMapper::aces;    // for HDR-FLIP
    int threads = 0;                              // 0 = one per core; does not change the result
};

struct FlipResult {
    ImageF map;  // 1 channel, 0..1
    double mean = 0;
    double max = 0;
};

// FLIP of linear values clamped to 0..1, as a display without tone mapping shows them.
FlipResult flip(const Pair& pair, const FlipSettings& settings);

// `range`: exposure_range() of the reference, or joined() over a sequence's references; must be
// equal for all variants that are compared.
FlipResult hdr_flip(const Pair& pair, const ExposureRange& range, const FlipSettings& settings);

}  // namespace postchain::metrics
