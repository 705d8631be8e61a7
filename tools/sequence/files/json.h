// JSON in tools/. chain/ and config/ write theirs with chain/base/json.h.
#pragma once

#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "chain/base/json.h"
#include "chain/base/parameter.h"
#include "chain/base/text.h"

namespace postchain::io {

using Json = nlohmann::ordered_json;

// On one line, or with `indent` spaces for each level. Paths and names may contain any bytes:
// invalid UTF-8 becomes U+FFFD, and characters that act on a terminal are escaped even if JSON
// allows them (chain/base/text.h).
std::string json_text(const Json& json, int indent = -1);

// An unset value becomes null, a point an array of two numbers.
Json json_of(const ParameterValue& value);
// Empty for other JSON values: an object, another array, an integer above 2^63 - 1.
std::optional<ParameterValue> value_of(const Json& json);

// The object that the text of `value` describes: json_text() writes a whole number without ".0", so
// here it is an integer.
Json json_from(const JsonValue& value);

}  // namespace postchain::io
