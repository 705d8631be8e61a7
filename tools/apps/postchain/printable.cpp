#include "tools/apps/postchain/printable.h"

#include <cstdint>
#include <cstdio>

namespace postchain {
namespace {

// The code point that begins at text[at], and how many bytes it takes; 0 bytes where it is no UTF-8
// (RFC 3629: no overlong forms, no surrogates, nothing above U+10FFFF).
struct CodePoint {
    uint32_t value = 0;
    size_t bytes = 0;
};
CodePoint code_point(std::string_view text, size_t at) {
    const auto byte = [&](size_t i) { return uint32_t(uint8_t(text[at + i])); };
    const uint32_t first = byte(0);
    if (first < 0x80) return {first, 1};
    const size_t count = first >= 0xf0 && first < 0xf8   ? 4
                         : first >= 0xe0 && first < 0xf0 ? 3
                         : first >= 0xc0 && first < 0xe0 ? 2
                                                         : 0;
    if (count == 0 || at + count > text.size()) return {};
    uint32_t value = first & (0xffu >> (count + 1));
    for (size_t i = 1; i < count; ++i) {
        if ((byte(i) & 0xc0) != 0x80) return {};
        value = value << 6 | (byte(i) & 0x3f);
    }
    static constexpr uint32_t kLeast[] = {0, 0, 0x80, 0x800, 0x10000};
    if (value < kLeast[count] || value > 0x10ffff || (value >= 0xd800 && value < 0xe000)) return {};
    return {value, count};
}

bool acts_on_a_terminal(uint32_t c) {
    return c < 0x20 || (c >= 0x7f && c < 0xa0) || c == 0x200e || c == 0x200f ||
           (c >= 0x2028 && c <= 0x202e) || (c >= 0x2066 && c <= 0x2069) || c == 0xfeff;
}

}  // namespace

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
