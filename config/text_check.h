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

// Finds places in constant time, even in a line of a million characters, and those of a parser,
// which goes forward, in a few steps. For one thread.
class PlaceIndex {
  public:
    explicit PlaceIndex(std::string_view text);
    TextPlace at(size_t offset) const;

  private:
    static constexpr size_t kStride = 256;  // bytes between two marks
    std::string_view text_;
    std::vector<TextPlace> marks_;
    mutable size_t last_ = 0;  // the offset that was asked for last, and its place
    mutable TextPlace last_place_;
};

struct TextFault {
    TextPlace place;
    std::string message;
};
// The first byte that is not UTF-8, or the first control character other than tab and line ends.
std::optional<TextFault> find_bad_character(std::string_view text);

// Whether [ ] and { }, outside quotes and comments, are nested deeper than `depth`, or hold more
// than `nodes` values. yaml-cpp reads such a text to its end before it tells the first value. The
// tree counts what the other forms have (indentation, "- - -", "? ? ?").
std::optional<TextFault> find_large_flow(std::string_view text, int depth, size_t nodes);

std::string nested_too_deep(int depth);
std::string too_many_nodes(size_t nodes);

// The first line before the document that begins with %.
std::optional<TextPlace> find_directive(std::string_view text);

}  // namespace postchain
