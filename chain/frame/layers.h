// Extra color layers of a frame (light groups, diffuse, specular, emission, ...) and mattes: how
// they are handed in and out. How they are filtered: docs/layers.md.
//
// A layer is a plane of four channels that is filtered as color is, with the weights that color
// has: each of its channels is the same linear function of that channel in the input. So layers
// that sum to color sum to it when they are filtered. It is color like the role `color`:
// scene-linear, premultiplied, of the same size, every value finite. Its fourth channel is filtered
// like an alpha: its own, or 0.
//
// The planes of all layers are stacked in one plane of the role `layers`, one below another: as
// wide as the frame and FrameDescription::layers times as high. Mattes, of one channel, are stacked
// likewise in the role `mattes`.
//
// A layer may be the fill mask (FrameDescription::fill_layer), (1, 0, 0, 0) in every pixel of this
// frame and of its neighbors. Filtered, it holds which shares of a pixel came from this frame, from
// a neighbor, and from an estimate (the color of a surface that no frame shows, or of one beyond
// the frame's border). A pass that fills with neither moves no share. If several passes fill, the
// later one averages the shares of the earlier one, and those stay that it does not fill again.
#pragma once

#include <vector>

#include "chain/base/image.h"

namespace postchain {

// Stacks images of one size, one below another.
ImageF stack_planes(const std::vector<ImageF>& planes);

// Plane `index` of such a stack, each `height` rows high.
ImageF plane_of_stack(const ImageF& stack, int index, int height);

}  // namespace postchain
