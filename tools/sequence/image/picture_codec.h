// Pictures of color through OpenImageIO. Part of the module of picture_calls.h.
#pragma once

#include "tools/sequence/image/picture_calls.h"

namespace postchain::io {

// See PictureCalls.
Result<PictureInfo> describe_picture(const std::string& path, const std::string& format);
Result<ImageF> read_stored_picture(const std::string& path, const PictureInfo& info);
Result<std::string> encode_picture(const PictureToWrite& picture);

}  // namespace postchain::io
