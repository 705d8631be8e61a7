#include "chain/base/text.h"

#include <cstdio>

namespace postchain {

std::string joined(const std::vector<std::string>& words, std::string_view separator) {
    std::string text;
    for (size_t i = 0; i < words.size(); ++i) {
        if (i > 0) text += separator;
        text += words[i];
    }
    return text;
}

std::string lower_case(std::string_view text) {
    std::string lower(text);
    for (char& c : lower)
        if (c >= 'A' && c <= 'Z') c = char(c - 'A' + 'a');
    return lower;
}

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
    static constexpr uint32_t kMinCode[] = {0, 0, 0x80, 0x800, 0x10000};
    if (value < kMinCode[count] || value > 0x10ffff || (value >= 0xd800 && value < 0xe000))
        return {};
    return {value, count};
}

bool acts_on_a_terminal(uint32_t c) {
    return c < 0x20 || (c >= 0x7f && c < 0xa0) || c == 0x061c || c == 0x200e || c == 0x200f ||
           (c >= 0x2028 && c <= 0x202e) || (c >= 0x2066 && c <= 0x2069) || c == 0xfeff;
}

std::string quoted(std::string_view text) {
    std::string out = "\"";
    for (size_t at = 0; at < text.size();) {
        const CodePoint c = code_point(text, at);
        const size_t bytes = c.bytes > 0 ? c.bytes : 1;
        if (c.value == '"' || c.value == '\\') out += '\\';
        if (c.bytes == 0) {
            out += "\\ufffd";
        } else if (c.value == '\n') {
            out += "\\n";  // Graphviz knows no \u000a
        } else if (acts_on_a_terminal(c.value)) {
            char escaped[8];
            std::snprintf(escaped, sizeof(escaped), "\\u%04x", unsigned(c.value));
            out += escaped;
        } else {
            out += text.substr(at, bytes);
        }
        at += bytes;
    }
    return out + "\"";
}

}  // namespace postchain
