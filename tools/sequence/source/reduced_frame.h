// A frame at a smaller size, for previews.
#pragma once

#include "chain/base/image.h"
#include "tools/sequence/source/frame_source.h"

namespace postchain::sequence {

// At least 1 pixel.
int reduced_side(int side, double scale);
// Reduces an image: each pixel is the center pixel of its area, so that surfaces are not mixed.
ImageF middle_reduced(const ImageF& image, int width, int height);

// Reduces the planes of a frame and of its neighbors: color, layers and mattes by mean, depth and
// motion vectors by center pixel. Scales motion vectors, sizes and bounds.
void reduce_frame(SourceFrame& source, double scale);

}  // namespace postchain::sequence
