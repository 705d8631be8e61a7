// Frames turned, moved and reduced to a dot, for the checks of equivariance and of energy.
#pragma once

#include "chain/frame.h"

namespace postchain::stress {

enum class Turn {
    mirror,   // left and right change places
    flip,     // top and bottom change places
    quarter,  // a quarter turn, clockwise on the screen
};

ImageF turned(const ImageF& image, Turn turn);
// turned_back(turned(image, turn), turn) is the image, bit for bit.
ImageF turned_back(const ImageF& image, Turn turn);
// Every plane, and the vectors of motion with them.
FramePlanes turned(const FramePlanes& planes, Turn turn);

struct Window {
    int x = 0;  // of its first pixel in the frame; may be negative
    int y = 0;
    int width = 0;
    int height = 0;
};
// What a window on the frame shows, when the frame goes on beyond its borders mirrored at them.
// Vectors there are those of the pixel shown, not mirrored: the plane is one picture like another.
ImageF seen_through(const ImageF& image, const Window& window);
FramePlanes seen_through(const FramePlanes& planes, const Window& window);

// side x side pixels, everywhere the depth and motion of the frame's middle pixel; black but for
// the pixel in the middle, which is `value` in all four channels.
FramePlanes dot_of(const FramePlanes& planes, int side, float value);

}  // namespace postchain::stress
