// A crop of a ray-traced frame, blurred by an independent implementation of the paper
// (tests/data/motion_blur).
#pragma once

#include "chain/base/image.h"
#include "chain/frame/frame.h"

namespace postchain::test {

struct WheelsCrop {
    static constexpr int kSize = 160, kInner = 80;  // pixels: of the planes, of the results
    FramePlanes planes;                             // color, inverse_depth, motion
    ImageF guertin, single;                         // RGB of the inner pixels, by mode
};
WheelsCrop read_wheels_crop();

}  // namespace postchain::test
