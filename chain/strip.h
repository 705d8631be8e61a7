// Rows of a picture whose planes are there in part.
#pragma once

namespace postchain {

// The planes hold rows of a picture from `top` on. Asked about are its rows first .. end - 1; the
// others are there because those look at them.
struct Strip {
    int top = 0;
    int first = 0;
    int end = 0;
    int height = 0;  // of the picture

    static Strip whole(int height) { return {0, 0, height, height}; }
};

}  // namespace postchain
