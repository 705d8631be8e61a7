// Loads the module of image_calls.h at its first use.
#pragma once

#include "chain/status.h"
#include "tools/sequence/image/image_calls.h"

namespace postchain::io {

// The module's functions; it stays loaded. The loader searches for it like the program's libraries:
// in the build tree, or in lib/postchain of the installation. Thread-safe. Errors (`code`), at
// every call: the module or a library that it needs is missing, or it has another version; with the
// file and a remedy.
Result<const ImageCalls*> image_module(StatusCode code);

}  // namespace postchain::io
