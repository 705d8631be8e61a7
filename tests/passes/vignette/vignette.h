// A pass that is not a blur: it darkens the corners. It shows that a pass is added with its folder,
// its shaders and a word, and that every suite runs with a pass that neither keeps constants nor
// commutes with shifts.
#pragma once

#include "chain/pass/pass.h"

namespace postchain::vignette {

// Reads and writes color.
const PassType& pass_type();

}  // namespace postchain::vignette
