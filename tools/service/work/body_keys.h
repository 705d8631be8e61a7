// The keys of each kind of body, with the JSON Schema of their values. Every other key is refused.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "chain/base/parameter.h"
#include "tools/sequence/files/json.h"

namespace postchain::service {

using BodyKeys = std::vector<std::pair<std::string, io::Json>>;

io::Json string_schema(const char* help);
io::Json strings_schema(const char* help);
io::Json string_or_object(const char* help);
// KEY and KEY_text.
void add_chain_keys(const std::string& key, BodyKeys& keys);
// The rows of a group of a table.
void add_row_keys(const ParameterTable& table, const std::string& group, BodyKeys& keys);

}  // namespace postchain::service
