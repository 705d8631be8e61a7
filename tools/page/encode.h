// Images as the page carries them: small, decoded by the browser's own zlib
// (tools/page/viewer/picture.js).
//
//   values --channel by channel--> differences modulo 2^bits, to the left (first column: to above;
//                                  the first value: to 0)
//   differences                --> all high bytes, then all low bytes --zlib--> --base64--> text
//
// Differences of neighbors are small, so that the high bytes nearly vanish.
#pragma once

#include <string>

#include "chain/base/image.h"
#include "chain/base/status.h"

namespace postchain::page {

// Three channels as 16-bit floats: values beyond the range of half become its largest, with their
// sign; NaN and Inf stay. Base64 of the deflated planes. Errors (internal): zlib.
Result<std::string> encode_color(const ImageF& rgb);

// One channel, or the first three, for a page that fetches it, as a file: "PPIC", width, height and
// channels in 32 bits each (little-endian), then the deflated planes.
Result<std::string> picture_file(const ImageF& color);
inline constexpr const char* kPictureType = "image/vnd.postchain";

// One channel, 0..1, in 255 steps; values are clamped, NaN becomes 1.
Result<std::string> encode_map(const ImageF& map);

}  // namespace postchain::page
