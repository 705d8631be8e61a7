// Small helpers for text that is printed or read.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace postchain {

// "a, b, c"
std::string joined(const std::vector<std::string>& words, std::string_view separator = ", ");

// A to Z become a to z.
std::string lower_case(std::string_view text);

// The code point that begins at text[at], and how many bytes it takes; 0 bytes if it is not UTF-8
// (RFC 3629: no overlong forms, no surrogates, nothing above U+10FFFF).
struct CodePoint {
    uint32_t value = 0;
    size_t bytes = 0;
};
CodePoint code_point(std::string_view text, size_t at);

// True for control characters and marks of writing direction: they move a cursor, change a color or
// reorder text.
bool acts_on_a_terminal(uint32_t code_point);

// In double quotes, valid in JSON and YAML whatever the bytes are: quotes, backslashes and
// characters that act on a terminal are escaped; bytes that are not UTF-8 become U+FFFD.
std::string quoted(std::string_view text);

}  // namespace postchain
