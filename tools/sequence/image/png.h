// 8-bit PNG in memory and text in it, a color map, and Base64.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "chain/base/image.h"
#include "chain/base/status.h"

namespace postchain::io {

// The bytes of a PNG file of one (gray) or three (sRGB) channels. Errors (output): the encoder's.
Result<std::string> encode_png(const Image<uint8_t>& pixels);

// Maps one channel of 0..1 to the published color map magma, display-referred sRGB. Values are
// clamped; NaN is written as 0.
Result<Image<uint8_t>> magma_of(const ImageF& values);

// RFC 4648, section 4.
std::string base64_of(std::string_view bytes);

// Text in a PNG (chunk tEXt) is used like an attribute of an EXR.
// Source: PNG Specification, Third Edition, 5 (chunks) and 11.3.3.2 (tEXt).
// The file `png` with `text` (ASCII) named `keyword` inserted after its header.
std::string with_png_text(std::string_view png, std::string_view keyword, std::string_view text);

// The text named `keyword`. Empty if there is none, or if `png` is not a complete PNG: a chunk is
// missing, truncated or damaged, or bytes follow the last one.
std::optional<std::string> png_text(std::string_view png, std::string_view keyword);

}  // namespace postchain::io
