// Checks of a host's frame.
#pragma once

#include <array>

#include "chain/guest/failure.h"
#include "chain/guest/host_frame.h"

namespace postchain::guest {

// Whole copies of a host's frame and its neighbors.
struct FrameCopy {
    pc_frame frame;
    std::array<pc_frame, kNeighbors.size()> neighbors;
};
// `read` becomes `given`, or `copy.frame` if the host's struct is smaller or has neighbors.
Failure read_frame(const pc_frame* given, FrameCopy& copy, const pc_frame*& read);
// Sets the neighbors of `frame`, which are in `copy`, without the members that do not count.
void set_neighbors(pc_frame& frame, std::array<const pc_frame*, kNeighbors.size()> given,
                   std::array<pc_frame, kNeighbors.size()>& copy);

// Without a camera cut, if the frame has neighbors, which a cut would leave unused.
inline pc_frame with_neighbors_in_use(pc_frame frame) {
    if (frame.before || frame.after) frame.flags &= ~uint32_t(PC_CAMERA_CUT);
    return frame;
}

// Errors name the member. PC_ERROR_INPUT: a texture. PC_ERROR_CHAIN: camera values that the depth
// encoding needs, or a value that is not finite. Calls no GL, allocates nothing. `find`: the
// formats of the textures.
Failure check_frame(const pc_frame* given, HostFrame& frame,
                    const HostFormat* (*find)(unsigned) = find_format);

// Whether all bits are flags of pc_frame.
bool knows_flags(uint32_t flags);

// For PC_VALIDATE: matrices that cannot be inverted, an output over another plane than color,
// bounds that contradict each other, and values that no lens has. Precondition: check_frame().
Failure check_deeper(const HostFrame& frame);

}  // namespace postchain::guest
