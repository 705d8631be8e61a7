// Text as Markdown shows it.
#pragma once

#include <string>

namespace postchain {

// Escapes what Markdown would read as HTML.
std::string markdown_text(const std::string& text);
// Escapes a string for a cell of a table: one line, bars escaped.
std::string markdown_cell(const std::string& text);

}  // namespace postchain
