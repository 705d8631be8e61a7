#include "config/text_check.h"

#include <algorithm>

#include "chain/base/text.h"

namespace postchain {
namespace {

std::string hex(uint32_t value) {
    const char* digits = "0123456789abcdef";
    return {'0', 'x', digits[value >> 4 & 15], digits[value & 15]};
}

}  // namespace

TextPlace place_at(std::string_view text, size_t offset, size_t from, TextPlace start) {
    TextPlace place = start;
    for (size_t i = from; i < std::min(offset, text.size()); ++i) {
        const auto c = static_cast<unsigned char>(text[i]);
        if (c == '\n') {
            ++place.line;
            place.column = 1;
        } else if ((c & 0xc0) != 0x80) {  // not a continuation byte
            ++place.column;
        }
    }
    return place;
}

std::optional<TextFault> find_bad_character(std::string_view text) {
    for (size_t i = 0; i < text.size();) {
        const CodePoint c = code_point(text, i);
        if (c.bytes == 0)
            return TextFault{place_at(text, i),
                             "byte " + hex(static_cast<unsigned char>(text[i])) + " is not UTF-8"};
        const bool space = c.value == '\t' || c.value == '\n' || c.value == '\r';
        if ((c.value < 0x20 && !space) || (c.value >= 0x7f && c.value < 0xa0))
            return TextFault{place_at(text, i),
                             "control character " + hex(c.value) + " is not allowed"};
        i += c.bytes;
    }
    return std::nullopt;
}

}  // namespace postchain
