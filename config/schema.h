// What the parameter tables say, as JSON Schema, text, JSON and Markdown. Everything comes from
// PassRegistry and camera_parameters(), the tables that also parse (config/chain_file.h).
#pragma once

#include <string>

#include "chain/pass.h"

namespace postchain {

// JSON Schema (draft 2020-12) of a chain file, indented. Two rules of the parser have no word in
// it: `excludes` and numbers written in a forbidden form.
std::string chain_schema(const PassRegistry& registry);

// Every pass and parameter with type, default, range and unit, and the rules of leaving out; the
// camera's rows and the chain's own rules at the end.
std::string passes_as_text(const PassRegistry& registry);
std::string passes_as_json(const PassRegistry& registry);      // one object on one line
std::string passes_as_markdown(const PassRegistry& registry);  // a table per pass

}  // namespace postchain
