// Turns frames, moves them and reduces them to a dot, for the checks of equivariance and energy.
#pragma once

#include "chain/frame/frame.h"

namespace postchain::stress {

enum class Turn {
    mirror,   // left and right are exchanged
    flip,     // top and bottom are exchanged
    quarter,  // a quarter turn clockwise in the image
};

ImageF turned(const ImageF& image, Turn turn);
// turned_back(turned(image, turn), turn) is the image, bit for bit.
ImageF turned_back(const ImageF& image, Turn turn);
FramePlanes turned(const FramePlanes& planes, Turn turn);

struct Window {
    int x = 0;  // of its first pixel in the frame; may be negative
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
