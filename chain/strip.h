// Rows of a frame of which only a part is in memory.
#pragma once

namespace postchain {

// The planes hold rows of a frame from `top` on. Results cover rows first .. end - 1; the other
// rows are there because these need them.
struct Strip {
    int top = 0;
    int first = 0;
    int end = 0;
    int height = 0;  // of the frame

    static Strip whole(int height) { return {0, 0, height, height}; }
};

}  // namespace postchain
