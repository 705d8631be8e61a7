// State of GL that each context of this project's own begins with.
#pragma once

#include "chain/gl/device.h"

namespace postchain::egl {

// On the current context. `debug`: KHR_debug messages go to device.log; `device` lives as long as
// the context.
void set_up_current(const gl::Device& device, bool debug);

}  // namespace postchain::egl
