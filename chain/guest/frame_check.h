// Checks of a host's frame.
#pragma once

#include "chain/guest/failure.h"
#include "chain/guest/host_frame.h"

namespace postchain::guest {

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
