// Values of parameters as JSON, for records and requests.
#pragma once

#include <optional>

#include "chain/parameter.h"
#include "tools/sequence/files/json.h"

namespace postchain::io {

// An unset value becomes null, a point an array of two numbers.
Json json_of(const ParameterValue& value);
// Empty for other JSON values: an object, another array, an integer above 2^63 - 1.
std::optional<ParameterValue> value_of(const Json& json);

}  // namespace postchain::io
