// Configurations of OpenColorIO: read when they are first used, and again once they have changed.
// Of the module of picture_calls.h.
#pragma once

#include <OpenImageIO/color.h>

#include <memory>
#include <string>
#include <vector>

#include "chain/status.h"

namespace postchain::io {

// The configuration of this file. It is kept, and read again when the file, or a table that it
// names, has another size or time of change. Any thread. Errors (input): no such file, none that
// OpenColorIO can read, one without a display.
Result<std::shared_ptr<OIIO::ColorConfig>> ocio_config(const std::string& path);

// As in PictureCalls.
Result<std::vector<std::string>> ocio_files(const std::string& path);

}  // namespace postchain::io
