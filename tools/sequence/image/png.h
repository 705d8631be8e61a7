// 8-bit PNG in memory, a color map, and Base64.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "chain/image.h"
#include "chain/status.h"

namespace postchain::io {

// The bytes of a PNG file of one (gray) or three (sRGB) channels. Errors (output): the encoder's.
Result<std::string> encode_png(const Image<uint8_t>& pixels);

// Maps one channel of 0..1 to the published color map magma, display-referred sRGB. Values are
// clamped; NaN counts as 0.
Result<Image<uint8_t>> magma_of(const ImageF& values);

// RFC 4648, section 4.
std::string base64_of(std::string_view bytes);

}  // namespace postchain::io
