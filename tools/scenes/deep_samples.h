// A frame and its layer behind as the samples of deep pixels.
#pragma once

#include "tools/scenes/renderer.h"
#include "tools/sequence/exr/deep_writer.h"

namespace postchain::scenes {

// A pixel has a front sample and one of `behind`; if `behind` shows the same, only the first.
// Flattened, the samples are `sharp`, and no value of color or alpha is negative. Behind an edge of
// partial coverage the second sample may have less than the color and alpha of `behind`.
io::DeepSamples deep_samples(const ScenePlanes& sharp, const ScenePlanes& behind);

}  // namespace postchain::scenes
