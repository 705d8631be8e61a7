// The parameter tables as text, JSON and Markdown: those that also parse (config/chain_file.h).
#pragma once

#include <string>

#include "chain/pass.h"

namespace postchain {

// Every pass and parameter with type, default, range and unit, and the rules of leaving out; the
// camera's rows and the chain's own rules at the end.
std::string passes_as_text(const PassRegistry& registry);
std::string passes_as_json(const PassRegistry& registry);      // one object on one line
std::string passes_as_markdown(const PassRegistry& registry);  // a table per pass

}  // namespace postchain
