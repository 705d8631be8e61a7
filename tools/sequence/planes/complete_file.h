// Checks whether a file that another program may still be writing is complete.
#pragma once

#include <string>

#include "chain/base/status.h"

namespace postchain::io {

// EXR: the header is complete, the offset of every chunk of every part is written, and each chunk
// ends within the file. Most writers fill in the table of offsets after the pixels, so it is zero
// until then. No pixel is decoded.
// Other formats (image_file.h): the file can be decoded. If a format has no table, or the file
// is created at its full size, only a constant size and modification time show that its writer is
// done: callers check twice. Errors (input), with the path: why it is not complete, or cannot be
// read.
Status check_complete(const std::string& path);

}  // namespace postchain::io
