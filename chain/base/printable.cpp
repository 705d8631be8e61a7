#include "chain/base/printable.h"

#include <cstdint>
#include <cstdio>

#include "chain/base/text.h"

namespace postchain {

std::string printable(std::string_view text, Lines lines) {
    std::string out;
    for (size_t at = 0; at < text.size();) {
        const CodePoint c = code_point(text, at);
        const size_t bytes = c.bytes > 0 ? c.bytes : 1;
        char escaped[16] = "";
        if (c.bytes == 0 || (c.bytes == 1 && acts_on_a_terminal(c.value)))
            std::snprintf(escaped, sizeof(escaped), "\\x%02x", unsigned(uint8_t(text[at])));
        else if (acts_on_a_terminal(c.value))
            std::snprintf(escaped, sizeof(escaped), "\\u{%x}", unsigned(c.value));
        if (c.value == '\n' || c.value == '\t') {
            if (lines == Lines::keep)
                out += char(c.value);
            else
                out += c.value == '\n' ? "\\n" : "\\t";
        } else if (escaped[0] != '\0') {
            out += escaped;
        } else {
            out += text.substr(at, bytes);
        }
        at += bytes;
    }
    return out;
}

}  // namespace postchain
