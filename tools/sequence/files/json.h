// JSON in tools/. chain/ and config/ write theirs with chain/base/json.h.
//
// An object looks its keys up one by one. So texts are read by read_json(), which limits the keys
// of an object; Json::parse() is for what this program has just written itself.
#pragma once

#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "chain/base/json.h"
#include "chain/base/parameter.h"
#include "chain/base/status.h"
#include "chain/base/text.h"
#include "config/text_tree.h"

namespace postchain::io {

using Json = nlohmann::ordered_json;

// On one line, or with `indent` spaces for each level. Paths and names may contain any bytes:
// invalid UTF-8 becomes U+FFFD, and characters that act on a terminal are escaped even if JSON
// allows them (chain/base/text.h). Settings in messages as_keys().
std::string json_text(const Json& json, int indent = -1);

// An unset value becomes null, a point an array of two numbers.
Json json_of(const ParameterValue& value);
// Empty for other JSON values: an object, another array, an integer above 2^63 - 1.
std::optional<ParameterValue> value_of(const Json& json);

// Adds a key that the object does not have.
void append(Json& object, const std::string& key, Json value);

// A list, map or scalar by the rules of config/scalar.h; what these refuse stays text.
Json json_of(const TextNode& node);

// For files that hold a value for each frame or measurement.
inline constexpr TextLimits kReportLimits = {
    .bytes = size_t(64) << 20, .depth = 64, .nodes = 4'000'000, .frame_keys = true};

// Errors (input): not JSON, or beyond a limit; with the place in `file_name`.
Result<Json> read_json(std::string_view text, const std::string& file_name,
                       const TextLimits& limits = {});

// The object that the text of `value` describes: json_text() writes a whole number without ".0", so
// here it is an integer.
Json json_from(const JsonValue& value);

}  // namespace postchain::io
