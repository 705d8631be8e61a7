// Depth and motion vector conventions of engines, by name.
#pragma once

#include <string>
#include <string_view>

#include "chain/guest/postchain.h"

namespace postchain::guest {

// Sets depth_encoding, flags of rows and vectors, motion_scale and motion_bias. False: unknown
// engine; the frame is unchanged. Reads width and height; if they are 0, those of color.
bool use_conventions(std::string_view engine, pc_frame& frame);

// Their names, separated by commas.
std::string engines_text();

}  // namespace postchain::guest
