// JSON outside chain/ and config/, which have a writer of their own (chain/json_writer.h).
#pragma once

#include <nlohmann/json.hpp>
#include <string>

namespace postchain::io {

using Json = nlohmann::ordered_json;

// On one line, or with `indent` spaces for each level. Paths and names may hold bytes that are not
// UTF-8: those are replaced, and end nothing.
inline std::string json_text(const Json& json, int indent = -1) {
    return json.dump(indent, ' ', false, Json::error_handler_t::replace);
}

}  // namespace postchain::io
