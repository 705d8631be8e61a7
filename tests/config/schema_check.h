// A validator for the JSON Schema keywords of chain_schema() (draft 2020-12), to compare schema and
// parser.
#pragma once

#include <string>

#include "config/text_tree.h"

namespace postchain::test {

// Empty if `instance` is valid by `schema`, otherwise the first reason, which may be an unknown
// keyword. `root` resolves $ref.
std::string schema_violation(const TextNode& instance, const TextNode& schema,
                             const TextNode& root);

}  // namespace postchain::test
