// The device and the threads that a program is told to work with.
#pragma once

#include <string>

#include "chain/egl/context.h"
#include "chain/gl/device.h"
#include "chain/status.h"

namespace postchain::sequence {

// `threads` or, where that is 0, one per core.
int threads_of(int threads);

// Applies `threads` (0: one per core) to OpenEXR and to the software renderer, and reads `device`:
// "auto", "software", or a number of egl::list_devices(). Errors (usage).
Result<egl::ContextOptions> context_options_of(const std::string& device, int threads);

// "llvmpipe (LLVM 15.0.6, 256 bits), 4.5 (Core Profile) Mesa 22.3.6"
std::string renderer_text(const gl::Device& device);

}  // namespace postchain::sequence
