// Text in a PNG (chunk tEXt), used like an attribute of an EXR.
//
// Source: PNG Specification, Third Edition, 5 (chunks) and 11.3.3.2 (tEXt).
#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace postchain::io {

// The file `png` with `text` (ASCII) named `keyword` inserted after its header.
std::string with_png_text(std::string_view png, std::string_view keyword, std::string_view text);

// The text named `keyword`. Empty if there is none, or if `png` is not a complete PNG: a chunk is
// missing, truncated or damaged, or bytes follow the last one.
std::optional<std::string> png_text(std::string_view png, std::string_view keyword);

}  // namespace postchain::io
