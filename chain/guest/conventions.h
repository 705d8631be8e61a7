// Conventions of depth and vectors that engines have, by name.
#pragma once

#include <string_view>

#include "chain/guest/postchain.h"

namespace postchain::guest {

// Sets depth_encoding, flags of rows and vectors, motion_scale and motion_bias. False: no such
// engine; the frame stays as it is. Reads width and height, color's where these are 0.
bool use_conventions(std::string_view engine, pc_frame& frame);

}  // namespace postchain::guest
