// A check of a text before it is read, and places in the text.
#pragma once

#include <compare>
#include <optional>
#include <string>
#include <string_view>

namespace postchain {

struct TextPlace {
    int line = 1;    // from 1
    int column = 1;  // from 1, in characters
    auto operator<=>(const TextPlace&) const = default;
};

// Place of the byte at `offset` in a UTF-8 text. Counts from the byte `from`, whose place is
// `start`.
TextPlace place_at(std::string_view text, size_t offset, size_t from = 0, TextPlace start = {});

struct TextFault {
    TextPlace place;
    std::string message;
};
// The first byte that is not UTF-8, or the first control character other than tab and line ends.
std::optional<TextFault> find_bad_character(std::string_view text);

}  // namespace postchain
