// Whether a file that another program may still be writing holds a whole picture.
#pragma once

#include <string>

#include "chain/status.h"

namespace postchain::io {

// Of an EXR: its header is whole, the offset of every chunk of every part has been written, and
// each chunk ends before the file does. Writers put the table of these offsets after the pixels,
// mostly, so it is zero until then; the reader alone would notice a missing chunk only when it is
// there (exr_header_scan.h). No pixel is decoded.
// Of a picture of another format (picture_format.h): it decodes. Where a file has no table to look
// at, or is written at its full size first, nothing but a size and a time that stay the same tells
// that its writer is done: callers look twice.
// Errors (input), with the path: why it is not whole, or cannot be read.
Status check_complete(const std::string& path);

}  // namespace postchain::io
