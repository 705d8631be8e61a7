// What the parameter tables say, as JSON Schema. Everything comes from PassRegistry and
// camera_parameters(), the tables that also parse (config/chain_file.h).
#pragma once

#include <string>

#include "chain/json_writer.h"
#include "chain/pass.h"

namespace postchain {

// JSON Schema (draft 2020-12) of a chain file, indented. Two rules of the parser have no word in
// it: `excludes` and numbers written in a forbidden form.
std::string chain_schema(const PassRegistry& registry);

// The schema of one row's value, after its key has been written.
void write_row_schema(JsonWriter& json, const Parameter& row);

}  // namespace postchain
