// What PC_VALIDATE asks GL about a host's textures.
#pragma once

#include "chain/guest/failure.h"
#include "chain/guest/host_frame.h"

namespace postchain::guest {

// Are the names textures of the current context, of the target, size and format that the host said?
// PC_ERROR_INPUT names the member and what GL says of it. Leaves no GL error.
Failure validate(const HostFrame& frame);

}  // namespace postchain::guest
