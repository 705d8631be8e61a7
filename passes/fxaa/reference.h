// Both stages of FXAA in double precision, from docs/fxaa.md and independently of
// the GLSL. Planes are row 0 at the top; edges clamp.
#pragma once

#include <array>

#include "chain/base/image.h"
#include "passes/fxaa/fxaa.h"

namespace postchain::fxaa {

// Luma: 1 channel, same size as color (4 channels). `weights` are the luminance weights of the
// file's primaries, used only by Luma::display.
ImageD reference_luma(const Parameters& parameters, const ImageD& color,
                      const std::array<double, 3>& weights);

// Stage "fxaa": as many channels as color, which may be wide (passes/common/wide_color.h). `hint`
// has 2 channels (tile gate, pixel gate, 0..1) or is nullptr.
ImageD reference_fxaa(const Parameters& parameters, const ImageD& color, const ImageD& luma,
                      const ImageD* hint);

}  // namespace postchain::fxaa
