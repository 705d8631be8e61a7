// The words of JSON Schema that chain_schema() uses, checked by the book (draft 2020-12), so that
// a test can hold schema and parser against each other.
#pragma once

#include <string>

#include "config/text_tree.h"

namespace postchain::test {

// Empty when `instance` is valid by `schema`, else the first reason. An unknown keyword is a
// reason too. `root` resolves $ref.
std::string schema_violation(const TextNode& instance, const TextNode& schema,
                             const TextNode& root);

}  // namespace postchain::test
