// The checks of a host's textures by PC_VALIDATE.
#pragma once

#include "chain/guest/failure.h"
#include "chain/guest/host_frame.h"

namespace postchain::guest {

// Checks that the names are textures of the current context, have the stated target, size and
// format, and are read and written as the frame means. PC_ERROR_INPUT names the member and GL's
// value. Leaves no GL error. Precondition: there is none.
Failure validate(const HostFrame& frame);
// One texture, with the target, level and layer of `checked`. `written`: as output.
Failure validate(const char* member, const pc_texture& given, const HostTexture& checked,
                 bool written);

}  // namespace postchain::guest
