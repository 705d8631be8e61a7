// Metrics of the displayed image: PSNR and SSIM after the display transform.
//
// SSIM: Wang, Bovik, Sheikh, Simoncelli, "Image quality assessment: from error visibility to
// structural similarity", IEEE TIP 13(4), 2004, with that paper's window and constants.
#pragma once

#include <optional>

#include "tools/metrics/pair.h"

namespace postchain::metrics {

inline constexpr double kDisplayGamma = 2.2;
inline constexpr int kSsimWindow = 11;     // pixels, odd
inline constexpr double kSsimSigma = 1.5;  // pixels
inline constexpr double kSsimK1 = 0.01;    // C1 = (K1 * range)^2, range 1
inline constexpr double kSsimK2 = 0.03;    // C2 = (K2 * range)^2
// For displayed values (Rec. 709).
inline constexpr double kDisplayLuma[3] = {0.2126, 0.7152, 0.0722};

// (max(v,0) / (1 + max(v,0)))^(1/2.2), in 0..1.
float display_value(float v);
ImageF display_luma(const RgbImage& image);

// 10 log10(1 / MSE of the displayed RGB), dB; the peak is 1. Empty if the images are equal
// (infinite PSNR).
std::optional<double> psnr(const Pair& pair);

// Mean of the luma's SSIM over all windows inside the image. Empty if a side is shorter than
// kSsimWindow.
std::optional<double> ssim(const Pair& pair);

}  // namespace postchain::metrics
