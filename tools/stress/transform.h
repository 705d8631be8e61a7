// Turns frames, moves them and reduces them to a dot, for the checks of equivariance and energy.
#pragma once

#include "chain/frame/frame.h"
#include "chain/pass/guarantees.h"

namespace postchain::stress {

// Mirrored, flipped, or a quarter turn clockwise in the image; no shift.
ImageF turned(const ImageF& image, Symmetry how);
// turned_back(turned(image, how), how) is the image, bit for bit.
ImageF turned_back(const ImageF& image, Symmetry how);
FramePlanes turned(const FramePlanes& planes, Symmetry how);

struct Window {
    int x = 0;  // first pixel's position in the frame; may be negative
    int y = 0;
    int width = 0;
    int height = 0;
};
// A window on the frame, which is mirrored at its borders. Vectors there are not mirrored: the
// plane is treated as an image.
ImageF seen_through(const ImageF& image, const Window& window);
FramePlanes seen_through(const FramePlanes& planes, const Window& window);

// side x side pixels with the depth and motion of the frame's center pixel everywhere; black except
// for the center pixel, which is `value` in all four channels.
FramePlanes dot_of(const FramePlanes& planes, int side, float value);

}  // namespace postchain::stress
