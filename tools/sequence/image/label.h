// Small text in pictures, of digits and letters that are drawn here: a machine that filters frames
// need not have a font.
#pragma once

#include <cstdint>
#include <string_view>

#include "chain/image.h"

namespace postchain::io {

inline constexpr int kLabelHeight = 14;  // pixels
// Pixels that a text takes from left to right.
int label_width(std::string_view text);
// Draws text in one gray (0..255) with its upper left corner at (x, y); what lies outside is cut.
// Digits, small letters and '-' are drawn, anything else is a gap.
void draw_label(Image<uint8_t>& picture, int x, int y, std::string_view text, uint8_t gray);

}  // namespace postchain::io
