// Filtered color in the convention of the file, or of the image in memory, that it was made from.
#pragma once

#include "chain/base/image.h"
#include "chain/frame/convert.h"

namespace postchain::sequence {

// Converts color back to the file's convention: undoes ConvertOptions::unpremultiplied. If alpha is
// 0, division is impossible: pixels that were clear in the file (`stored`) and received no light
// get their color back. Values that the chain did not change are those stored, bit for bit.
void to_file_convention(ImageF& color, const ConvertOptions& conversion, const ImageF& stored);
// to_file_convention() for a layer, which is stored like color; `color` holds its alpha.
void layer_to_file_convention(ImageF& layer, const ConvertOptions& conversion, const ImageF& color);

}  // namespace postchain::sequence
