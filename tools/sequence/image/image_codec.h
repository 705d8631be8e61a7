// Images of color through OpenImageIO, after checks of the file's bytes that it does not make: the
// format, whether the file is complete, and how much memory its header may require. Part of the
// module of image_calls.h.
#pragma once

#include <cstdint>
#include <string>

#include "chain/base/status.h"
#include "tools/sequence/image/image_calls.h"

namespace postchain::io {

// See ImageCalls.
Result<ImageInfo> describe_image(const std::string& path, const std::string& format);
Result<ImageF> read_stored_image(const std::string& path, const ImageInfo& info);
Result<std::string> encode_image(const ImageToWrite& picture);

}  // namespace postchain::io
