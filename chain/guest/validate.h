// Checks that read a host's textures or ask GL about them: PC_VALIDATE and pc_check_motion().
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

// pc_check_motion(). Reads color, motion and the other color back, and waits.
Failure check_motion(const pc_frame* frame, const pc_texture& other_color, int signs[2],
                     float& margin);

}  // namespace postchain::guest
