// Scalars of the text tree -> values, by the strict rules of text_tree.h, and back.
#pragma once

#include <string>

#include "chain/parameter.h"
#include "config/text_tree.h"

namespace postchain {

// The value of a scalar by the rules of text_tree.h; monostate for null. Errors
// (StatusCode::chain): non-finite numbers, octal, hexadecimal and binary numbers, digits grouped by
// _, numbers too large for the type. The message speaks of the value alone. Locale-independent.
Result<ParameterValue> value_of(const TextNode& node);
Result<ParameterValue> value_of_plain_text(const std::string& text);

// Text written so that read_text_tree() reads it back as this value: strings are quoted where
// plain text would mean something else.
std::string yaml_text_of(const ParameterValue& value);

}  // namespace postchain
