#include "config/text_check.h"

#include <algorithm>

#include "chain/base/status.h"

namespace postchain {
namespace {

std::string hex_byte(unsigned char byte) {
    const char* digits = "0123456789abcdef";
    return {'0', 'x', digits[byte >> 4], digits[byte & 15]};
}

// Length of the UTF-8 sequence at `at`, 0 if it is invalid. Table 3-7 of the Unicode standard:
// no overlong forms, no surrogates, nothing above U+10FFFF.
size_t sequence_length(std::string_view text, size_t at) {
    const auto byte = [&](size_t i) -> unsigned {
        return at + i < text.size() ? static_cast<unsigned char>(text[at + i]) : 0u;
    };
    const auto in = [](unsigned value, unsigned low, unsigned high) {
        return value >= low && value <= high;
    };
    const unsigned first = byte(0);
    if (first < 0x80) return 1;
    if (in(first, 0xc2, 0xdf)) return in(byte(1), 0x80, 0xbf) ? 2 : 0;
    if (in(first, 0xe0, 0xef)) {
        const unsigned low = first == 0xe0 ? 0xa0 : 0x80, high = first == 0xed ? 0x9f : 0xbf;
        return in(byte(1), low, high) && in(byte(2), 0x80, 0xbf) ? 3 : 0;
    }
    if (in(first, 0xf0, 0xf4)) {
        const unsigned low = first == 0xf0 ? 0x90 : 0x80, high = first == 0xf4 ? 0x8f : 0xbf;
        return in(byte(1), low, high) && in(byte(2), 0x80, 0xbf) && in(byte(3), 0x80, 0xbf) ? 4 : 0;
    }
    return 0;
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

PlaceIndex::PlaceIndex(std::string_view text) : text_(text), marks_(1) {
    for (size_t at = kStride; at <= text.size(); at += kStride)
        marks_.push_back(place_at(text, at, at - kStride, marks_.back()));
}

TextPlace PlaceIndex::at(size_t offset) const {
    if (offset < last_ || offset - last_ > kStride) {
        const size_t mark = std::min(offset / kStride, marks_.size() - 1);
        last_ = mark * kStride;
        last_place_ = marks_[mark];
    }
    last_place_ = place_at(text_, offset, last_, last_place_);
    last_ = offset;
    return last_place_;
}

std::optional<TextFault> find_bad_character(std::string_view text) {
    for (size_t i = 0; i < text.size();) {
        const auto c = static_cast<unsigned char>(text[i]);
        const size_t length = sequence_length(text, i);
        if (length == 0)
            return TextFault{place_at(text, i), "byte " + hex_byte(c) + " is not UTF-8"};
        const bool c1 = length == 2 && c == 0xc2 && static_cast<unsigned char>(text[i + 1]) < 0xa0;
        if ((c < 0x20 && c != '\t' && c != '\n' && c != '\r') || c == 0x7f || c1)
            return TextFault{place_at(text, i),
                             "control character " +
                                 hex_byte(static_cast<unsigned char>(text[i + length - 1])) +
                                 " is not allowed"};
        i += length;
    }
    return std::nullopt;
}

std::string nested_too_deep(int depth) {
    return concat("nested deeper than ", depth, " levels");
}

std::string too_many_nodes(size_t nodes) {
    return concat("more than ", nodes, " values; shorten it");
}

std::optional<TextFault> find_large_flow(std::string_view text, int depth, size_t nodes) {
    int level = 0;
    size_t found = 0;
    char before = '\n';
    for (size_t i = 0; i < text.size(); ++i) {
        const char c = text[i];
        const bool after_space =
            before == ' ' || before == '\t' || before == '\n' || before == '\r';
        const bool may_quote =
            after_space || before == '[' || before == '{' || before == ',' || before == ':';
        if (c == '#' && after_space) {
            i = std::min(text.find('\n', i), text.size() - 1);
        } else if ((c == '"' || c == '\'') && may_quote) {
            for (++i; i < text.size() && text[i] != c; ++i)
                if (c == '"' && text[i] == '\\') ++i;
        } else if (c == '[' || c == '{') {
            if (++level > depth) return TextFault{place_at(text, i), nested_too_deep(depth)};
            ++found;
        } else if (c == ',' && level > 0) {
            ++found;
        } else if ((c == ']' || c == '}') && level > 0) {
            --level;
        }
        if (found > nodes) return TextFault{place_at(text, i), too_many_nodes(nodes)};
        before = i < text.size() ? text[i] : ' ';
    }
    return std::nullopt;
}

std::optional<TextPlace> find_directive(std::string_view text) {
    for (size_t at = 0; at < text.size();) {
        const size_t end = std::min(text.find('\n', at), text.size());
        const std::string_view line = text.substr(at, end - at);
        if (line.starts_with('%')) return place_at(text, at);
        const size_t first = line.find_first_not_of(" \t\r");
        if (first != std::string_view::npos && line[first] != '#') return std::nullopt;
        at = end + 1;
    }
    return std::nullopt;
}

}  // namespace postchain
