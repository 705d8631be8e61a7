// Checks of a text before yaml-cpp reads it, and places in the text.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace postchain {

struct TextPlace {
    int line = 1;    // from 1
    int column = 1;  // from 1, in characters
};

// Place of the byte at `offset` in a UTF-8 text. Counts from the byte `from`, whose place is
// `start`.
TextPlace place_at(std::string_view text, size_t offset, size_t from = 0, TextPlace start = {});

// Finds places in constant time, even in a line of a million characters.
class PlaceIndex {
  public:
    explicit PlaceIndex(std::string_view text);
    TextPlace at(size_t offset) const;

  private:
    static constexpr size_t kStride = 256;  // bytes between two marks
    std::string_view text_;
    std::vector<TextPlace> marks_;
};

struct BadCharacter {
    TextPlace place;
    std::string message;
};
// The first byte that is not UTF-8, or the first control character other than tab and line ends.
std::optional<BadCharacter> find_bad_character(std::string_view text);

// The bracket that opens level depth + 1 of [ ] and { }, outside quotes and comments. This check
// saves yaml-cpp the memory of a million open brackets. The tree counts the levels of the other
// forms (indentation, "- - -", "? ? ?").
std::optional<TextPlace> find_deep_bracket(std::string_view text, int depth);

// The first line before the document that begins with %.
std::optional<TextPlace> find_directive(std::string_view text);

// JSON writes a character beyond U+FFFF as two escapes, \ud83d\ude00, which YAML does not allow.
// Replaces each pair by the one escape \U0001f600. Columns behind it in that line decrease by 2.
std::string join_surrogates(std::string_view text);

}  // namespace postchain
