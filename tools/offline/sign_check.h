// Sign self-check of vectors: warps frame n by its vectors under every combination of signs and
// of the two vector planes, and compares with frame n + 1. Source: spec frame.md.
#pragma once

#include <string>
#include <vector>

#include "chain/frame.h"

namespace postchain::offline {

struct SignCandidate {
    Role plane = Role::motion;  // motion or motion_back
    int sign_x = 1;             // 1 = as converted
    int sign_y = 1;
    double error = 0;  // mean difference of the warped colors, after x/(1+x), capped at 0.25

    bool as_converted() const { return plane == Role::motion && sign_x == 1 && sign_y == 1; }
    std::string text() const;  // "motion (+x, -y)"
};

struct SignCheck {
    std::vector<SignCandidate> candidates;  // best first; eight, or four without motion_back
    size_t pixels = 0;                      // that move by at least a pixel and stay in the image
    double still_error = 0;                 // of no warp at all, over the same pixels

    // Error of the best wrong candidate over that of the conversion as it stands: > 1 = confirmed.
    double margin() const;
};

// `planes` canonical (color, motion, motion_back if there is one), `next` the color of the next
// frame, of the same size. Empty candidates when nothing moves or sizes differ.
SignCheck check_signs(const FramePlanes& planes, const ImageF& next);

}  // namespace postchain::offline
