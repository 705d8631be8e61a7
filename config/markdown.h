// Text as Markdown shows it.
#pragma once

#include <string>

namespace postchain {

// One line of printable() text: what Markdown would read as HTML or as an escape is escaped.
std::string markdown_text(const std::string& text);
// The same for a cell of a table: bars are escaped too.
std::string markdown_cell(const std::string& text);

}  // namespace postchain
