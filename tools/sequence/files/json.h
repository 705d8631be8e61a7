// JSON in tools/. chain/ and config/ write theirs with chain/json.h.
#pragma once

#include <cstdio>
#include <nlohmann/json.hpp>
#include <string>

#include "chain/text.h"

namespace postchain::io {

using Json = nlohmann::ordered_json;

// On one line, or with `indent` spaces for each level. Paths and names may contain any bytes:
// invalid UTF-8 becomes U+FFFD, and characters that act on a terminal are escaped even if JSON
// allows them (chain/text.h).
inline std::string json_text(const Json& json, int indent = -1) {
    const std::string text = json.dump(indent, ' ', false, Json::error_handler_t::replace);
    std::string out;
    out.reserve(text.size());
    for (size_t at = 0; at < text.size();) {
        const CodePoint c = code_point(text, at);
        // Line feeds between values come from the indent.
        if (c.value != '\n' && acts_on_a_terminal(c.value)) {
            char escaped[8];
            std::snprintf(escaped, sizeof(escaped), "\\u%04x", unsigned(c.value));
            out += escaped;
        } else {
            out += text.substr(at, c.bytes);
        }
        at += c.bytes;  // dump() returns valid UTF-8
    }
    return out;
}

}  // namespace postchain::io
