// Device and thread count of a program.
#pragma once

#include <string>

#include "chain/base/status.h"
#include "chain/egl/context.h"
#include "chain/gl/device.h"

namespace postchain::sequence {

// `threads`, or one per core if 0.
int threads_of(int threads);

// Applies `threads` (0 = one per core) to OpenEXR and the software renderer, and parses `device`:
// "auto", "gpu", "software", or an index into egl::list_devices(). `warn` is called once if "auto"
// finds no GPU, however many contexts are made, or if the disk of Mesa's cache of programs is full:
// then this process uses none. Errors (usage).
Result<egl::ContextOptions> choose_device(const std::string& device, int threads,
                                          gl::LogCallback warn = {});

// "llvmpipe (LLVM 15.0.6, 256 bits), 4.5 (Core Profile) Mesa 22.3.6"
std::string renderer_text(const gl::Device& device);

}  // namespace postchain::sequence
