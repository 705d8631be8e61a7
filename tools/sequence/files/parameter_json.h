// JSON objects from parameter values and from what chain/ writes as JSON.
#pragma once

#include <optional>

#include "chain/json.h"
#include "chain/parameter.h"
#include "tools/sequence/files/json.h"

namespace postchain::io {

// An unset value becomes null, a point an array of two numbers.
Json json_of(const ParameterValue& value);
// Empty for other JSON values: an object, another array, an integer above 2^63 - 1.
std::optional<ParameterValue> value_of(const Json& json);

// The object that the text of `value` describes: json_text() writes a whole number without ".0", so
// here it is an integer.
Json json_from(const JsonValue& value);

}  // namespace postchain::io
