// JSON Schema of the parameter tables in PassRegistry and camera_parameters(), the same tables that
// parse chain files (config/chain_file.h).
#pragma once

#include <string>

#include "chain/base/json.h"
#include "chain/pass/pass.h"

namespace postchain {

// JSON Schema (draft 2020-12) of a chain file, indented. JSON Schema cannot express one rule of the
// parser: the forbidden forms of numbers.
std::string chain_schema(const PassRegistry& registry);

// The schema of one row's value.
JsonObject row_schema(const Parameter& row);

}  // namespace postchain
