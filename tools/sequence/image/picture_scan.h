// What OpenImageIO does not check of a picture's file, found in its bytes: which format it is of,
// whether it is whole, and how much memory its header may ask for. Of the module of
// picture_calls.h.
#pragma once

#include <cstdint>
#include <string>

#include "chain/status.h"
#include "tools/sequence/image/picture_calls.h"

namespace postchain::io {

// By the file's first bytes it is of `format` (in OpenImageIO's words), and what its header says of
// texts and data of its writer is in the file, at most 64 MiB. No other reader is tried on it.
// Errors (input), without the path.
Status check_content(const std::string& path, const std::string& format);

// The most bytes of stored values that a file of `file_bytes` can hold: what its packing
// (`compression` in OpenImageIO's words, of TIFF) makes of its bytes at best.
uint64_t most_stored_bytes(const std::string& format, const std::string& compression,
                           uint64_t file_bytes);

// The file ends before its pixels do. OpenImageIO does not say that of JPEG and DPX.
bool is_cut(const std::string& path, const std::string& format, const PictureInfo& info);

uint64_t bytes_in(const std::string& path);

}  // namespace postchain::io
