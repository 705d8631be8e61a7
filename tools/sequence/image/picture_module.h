// Loads the module of picture_calls.h at its first use.
#pragma once

#include "chain/status.h"
#include "tools/sequence/image/picture_calls.h"

namespace postchain::io {

// The module's functions; it stays loaded. It is looked for where the loader looks for the
// libraries of this program: in the build tree, or in lib/postchain of the installation. Any
// thread. Errors (`code`), each time: it is missing, a library that it needs is, or it belongs to
// another version; with the file and what to do.
Result<const PictureCalls*> picture_module(StatusCode code);

}  // namespace postchain::io
