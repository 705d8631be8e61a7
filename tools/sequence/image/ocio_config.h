// Color by a configuration of OpenColorIO, which is read at its first use, and again after changes.
// Part of the module of image_calls.h.
#pragma once

#include <OpenImageIO/color.h>

#include <memory>
#include <string>

#include "chain/base/status.h"
#include "tools/sequence/image/image_calls.h"

namespace postchain::io {

// The configuration of this file. It is kept, and read again if the size or modification time of
// the file, or of a table that it names, has changed. Thread-safe. Errors (input): missing file,
// OpenColorIO cannot read it, no display.
Result<std::shared_ptr<OIIO::ColorConfig>> ocio_config(const std::string& path);

// See ImageCalls.
Result<OcioSources> ocio_sources(const std::string& path);

// See ImageCalls.
Status from_ocio_space(ImageF& color, const OcioSpace& space);
Status to_ocio_space(ImageF& color, const OcioSpace& space);
Status to_ocio_view(ImageF& color, const DisplayView& view);

}  // namespace postchain::io
