// Sign self-check of vectors: warps frame n by its vectors under every combination of signs and
// of the two vector planes, and compares with frame n + 1. Described in docs/command.md.
#pragma once

#include <string>
#include <vector>

#include "chain/base/image.h"
#include "chain/frame/frame.h"

namespace postchain {

struct SignCandidate {
    Role plane = Role::motion;  // motion or motion_back
    int sign_x = 1;             // 1 = as converted
    int sign_y = 1;
    double error = 0;  // mean difference of the warped colors, after x/(1+x), capped at 0.25
    // Pixels where this candidate points elsewhere than the conversion (by half a pixel or more),
    // and its error over those pixels divided by that of the conversion: > 1 = the conversion is
    // better. Constant motion has motion_back = motion, and a pan has no y to have a sign.
    size_t pixels_apart = 0;
    double margin = 1;

    bool as_converted() const { return plane == Role::motion && sign_x == 1 && sign_y == 1; }
    std::string text() const;  // "motion (+x, -y)"
};

enum class SignVerdict {
    confirmed,     // every candidate that can be told apart is worse by kSignMargin
    undecided,     // some is not, or none can be told apart
    contradicted,  // some is better by kSignMargin
};
const char* name_of(SignVerdict verdict);
inline constexpr double kSignMargin = 1.1;

struct SignCheck {
    std::vector<SignCandidate> candidates;  // best first; eight, or four without motion_back
    size_t pixels = 0;                      // that move by at least a pixel and stay in the image
    double still_error = 0;                 // error without a warp, over the same pixels
    std::string why_not;                    // why there are no candidates; otherwise empty

    // A candidate counts if at least one moving pixel in fifty tells it apart.
    bool told_apart(const SignCandidate& candidate) const {
        return candidate.pixels_apart * 50 >= pixels && candidate.pixels_apart > 0;
    }
    double margin() const;  // the smallest over the candidates that count; 1 if none does
    SignVerdict verdict() const;
    // The change of the profile that helps if a candidate contradicts the conversion; otherwise
    // empty.
    std::string remedy() const;
};

// `planes` canonical (color, motion, motion_back if there is one), `next` the color of the next
// frame at the same place (io::placed()). No candidates if nothing moves by a pixel, everything
// that moves leaves the frame, or sizes differ.
SignCheck check_signs(PlaneView planes, const ImageF& next);

}  // namespace postchain
