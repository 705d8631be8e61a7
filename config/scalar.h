// Nodes of the text tree -> values, by the strict rules of text_tree.h, and back.
#pragma once

#include <string>

#include "chain/base/parameter.h"
#include "config/text_tree.h"

namespace postchain {

// The value of a scalar or of a list of two numbers; monostate for null. Errors
// (StatusCode::chain): numbers that begin with 0 (010) or are too large. The message names the
// value only, not its place. Does not depend on the locale.
Result<ParameterValue> value_of(const TextNode& node);
Result<ParameterValue> value_of_plain_text(const std::string& text);

// Errors (StatusCode::chain): not a number; not an integer in least..most.
Result<double> number_of(const TextNode& node);
Result<int> integer_of(const TextNode& node, int least, int most);

// Sets a row of `table`. Errors (StatusCode::chain) as value_of() and ParameterTable::set().
Status set_row(const ParameterTable& table, ParameterRef parameters, const Parameter& row,
               const TextNode& value);

// Text that read_text_tree() reads back as this value: a string is quoted if its plain text would
// mean something else.
std::string yaml_text_of(const ParameterValue& value);

}  // namespace postchain
