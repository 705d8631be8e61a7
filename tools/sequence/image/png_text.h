// A text that a PNG carries (chunk tEXt), as the attribute of an EXR is.
//
// Source: PNG Specification, Third Edition, 5 (chunks) and 11.3.3.2 (tEXt).
#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace postchain::io {

// The file `png` with `text` (ASCII) of the name `keyword` behind its header.
std::string with_png_text(std::string_view png, std::string_view keyword, std::string_view text);

// The text of that name. Nothing where there is none, or `png` is no whole PNG: a chunk is missing,
// cut off or damaged, or something follows the last one.
std::optional<std::string> png_text(std::string_view png, std::string_view keyword);

}  // namespace postchain::io
