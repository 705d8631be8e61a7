#include "config/markdown.h"

#include "chain/base/printable.h"

namespace postchain {

std::string markdown_text(const std::string& text) {
    std::string out;
    for (const char c : printable(text))
        out += c == '<' ? "&lt;" : c == '&' ? "&amp;" : c == '\\' ? "\\\\" : std::string(1, c);
    return out;
}

std::string markdown_cell(const std::string& text) {
    std::string out;
    for (const char c : markdown_text(text)) out += c == '|' ? "\\|" : std::string(1, c);
    return out;
}

}  // namespace postchain
