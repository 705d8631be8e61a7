#include "config/markdown.h"

namespace postchain {

std::string markdown_text(const std::string& text) {
    std::string out;
    for (const char c : text) out += c == '<' ? "&lt;" : c == '&' ? "&amp;" : std::string(1, c);
    return out;
}

std::string markdown_cell(const std::string& text) {
    std::string out;
    for (const char c : markdown_text(text))
        out += c == '|' ? "\\|" : c == '\n' || c == '\r' ? " " : std::string(1, c);
    return out;
}

}  // namespace postchain
