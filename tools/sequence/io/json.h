// JSON outside chain/ and config/, which have a writer of their own (chain/json_writer.h).
#pragma once

#include <cstdint>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <string>

namespace postchain::io {

using Json = nlohmann::ordered_json;

// On one line, or with `indent` spaces for each level. Paths and names may hold bytes that are not
// UTF-8: those are replaced, and end nothing.
// Characters that act on a terminal are escaped too where JSON would not ask for it: DEL, the C1
// controls, marks of writing direction.
inline std::string json_text(const Json& json, int indent = -1) {
    const std::string text = json.dump(indent, ' ', false, Json::error_handler_t::replace);
    std::string out;
    out.reserve(text.size());
    for (size_t at = 0; at < text.size(); ++at) {
        const auto byte = [&](size_t i) {
            return at + i < text.size() ? unsigned(uint8_t(text[at + i])) : 0u;
        };
        unsigned code = 0;  // outside ASCII there are only strings, whose UTF-8 is valid
        if (byte(0) == 0x7f) code = 0x7f;
        if (byte(0) == 0xc2 && byte(1) < 0xa0) code = byte(1);
        if (byte(0) == 0xe2 && (byte(1) == 0x80 || byte(1) == 0x81))
            code = 0x2000 | (byte(1) & 0x3f) << 6 | (byte(2) & 0x3f);
        const bool acts = code == 0x7f || (code >= 0x80 && code < 0xa0) || code == 0x200e ||
                          code == 0x200f || (code >= 0x2028 && code <= 0x202e) ||
                          (code >= 0x2066 && code <= 0x2069);
        if (!acts) {
            out += text[at];
            continue;
        }
        char escaped[8];
        std::snprintf(escaped, sizeof(escaped), "\\u%04x", code);
        out += escaped;
        at += code >= 0x2000 ? 2 : code >= 0x80 ? 1 : 0;
    }
    return out;
}

}  // namespace postchain::io
