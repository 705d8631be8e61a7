// A validator for the JSON Schema keywords of chain_schema() (draft 2020-12), to compare schema and
// parser.
#pragma once

#include <string>

#include "chain/pass/pass.h"
#include "config/text_tree.h"

namespace postchain::test {

// The tree of a text without a fault.
TextNode tree_of(const std::string& text);

class ChainSchema {
  public:
    explicit ChainSchema(const PassRegistry& passes);
    // Empty if the chain file is valid by the schema, otherwise the first reason, which may be an
    // unknown keyword.
    std::string violation(const std::string& text) const;

  private:
    TextNode schema_;
};

}  // namespace postchain::test
