// Checks of an image file's bytes that OpenImageIO does not make: its format, whether it is
// complete, and how much memory its header may require. Part of the module of image_calls.h.
#pragma once

#include <cstdint>
#include <string>

#include "chain/status.h"
#include "tools/sequence/image/image_calls.h"

namespace postchain::io {

// Checks that the file's first bytes are those of `format` (OpenImageIO's name), and that strings
// and user data stated by its header are in the file and take at most 64 MiB. Errors (input),
// without the path.
Status check_content(const std::string& path, const std::string& format);

// The most bytes of stored values that a file of `file_bytes` can hold, at the highest ratio of its
// compression (`compression`: of TIFF, OpenImageIO's name).
uint64_t most_stored_bytes(const std::string& format, const std::string& compression,
                           uint64_t file_bytes);

// Whether the file ends before its pixels do. OpenImageIO does not report that for JPEG and DPX.
bool is_cut(const std::string& path, const std::string& format, const ImageInfo& info);

uint64_t bytes_in(const std::string& path);

}  // namespace postchain::io
