// Pictures as a view of an OpenColorIO configuration shows them; of the module of picture_calls.h.
#pragma once

#include "tools/sequence/io/picture_calls.h"

namespace postchain::io {

// As PictureCalls::shown.
Result<Image<uint8_t>> shown_by_view(const ImageF& color, const DisplayView& view);

}  // namespace postchain::io
