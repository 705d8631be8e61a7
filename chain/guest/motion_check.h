// The sign self-check of chain/sign_check.h on a host's textures.
#pragma once

#include "chain/guest/failure.h"

namespace postchain::guest {

// pc_check_motion(). Reads color, motion and the other color back, and waits.
Failure check_motion(const pc_frame* frame, const pc_texture& other_color, int signs[2],
                     float& margin);

}  // namespace postchain::guest
