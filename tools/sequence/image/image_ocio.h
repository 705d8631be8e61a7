// Color by a configuration of OpenColorIO. Part of the module of image_calls.h.
#pragma once

#include "tools/sequence/image/image_calls.h"

namespace postchain::io {

// See ImageCalls.
Status from_ocio_space(ImageF& color, const OcioSpace& space);
Status to_ocio_space(ImageF& color, const OcioSpace& space);
Status to_ocio_view(ImageF& color, const DisplayView& view);

}  // namespace postchain::io
