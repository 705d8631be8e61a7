// The parameter tables that parse chain files (config/chain_file.h), as text, JSON and Markdown.
#pragma once

#include <string>

#include "chain/pass/pass.h"

namespace postchain {

// Every pass with its elision rules and its parameters (type, default, range, unit), then the
// camera's rows and the chain's own rules.
std::string passes_as_text(const PassRegistry& registry);
std::string passes_as_json(const PassRegistry& registry);      // one object on one line
std::string passes_as_markdown(const PassRegistry& registry);  // a table per pass

// One pass: its part of these outputs.
std::string pass_as_text(const PassType& type);
std::string pass_as_json(const PassType& type);
std::string pass_as_markdown(const PassType& type);

}  // namespace postchain
