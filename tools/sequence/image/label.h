// Draws small text into images with a font of its own, since render nodes may have none.
#pragma once

#include <cstdint>
#include <string_view>

#include "chain/image.h"

namespace postchain::io {

inline constexpr int kLabelHeight = 14;  // pixels
// Width of a text, pixels.
int label_width(std::string_view text);
// Draws text in one gray (0..255) with its upper left corner at (x, y), clipped to the image.
// Digits, lower-case letters and '-' are drawn; any other character is a gap.
void draw_label(Image<uint8_t>& picture, int x, int y, std::string_view text, uint8_t gray);

}  // namespace postchain::io
