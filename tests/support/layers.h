// Frames whose lights sum to color, and objects in them that a matte covers.
#pragma once

#include <gtest/gtest.h>

#include "chain/frame/layers.h"
#include "tests/support/gpu.h"
#include "tests/support/images.h"

namespace postchain::test {

// Two layers that both move, one out of focus, with highlights up to 40 and holes in its alpha.
TestFrame bright_frame(int width, int height);

// Gives the frame's vectors back to the frame before: other ones than forth.
void add_motion_back(TestFrame& frame);

// Hands in one matte, of the frame and of its neighbors, for this number of passes.
void add_matte(TestFrame& frame, const ImageF& matte, size_t passes);

// The near square of bright_frame(), with a soft edge of `soft_px` around it.
ImageF square_matte(int width, int height, int soft_px = 0);

// The sum of the layers that stand in `layers`.
ImageF sum_of_layers(const ImageF& layers, int height);

// Largest difference of any channel, as a part of the largest value of `b`.
double relative_difference(const ImageF& a, const ImageF& b);

}  // namespace postchain::test
