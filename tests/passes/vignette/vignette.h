// A pass that is no blur: it darkens the corners. Kept to show that a pass is added with its
// folder, its shaders and a word, and that every suite takes up one that neither keeps constants
// nor moves with the picture.
#pragma once

#include "chain/pass.h"

namespace postchain::vignette {

// Reads and writes color.
const PassType& pass_type();

}  // namespace postchain::vignette
