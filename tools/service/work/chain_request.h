// The chains of a request: named, in a file, an object or a text; with the overrides of `set` and
// the variants of `sweep`.
#pragma once

#include <string>
#include <vector>

#include "chain/pass.h"
#include "config/chain_find.h"
#include "tools/measure/experiment/sweep.h"
#include "tools/service/work/request_body.h"

namespace postchain::service {

class ChainReader {
  public:
    // The arguments outlive this object. Reads `set`.
    ChainReader(RequestBody& body, const Roots& roots, const PassRegistry& registry);

    // The chain of KEY or KEY_text.
    void read(const std::string& key, experiment::NamedChain& chain, ChainText& text);
    // The variants of `sweep`; empty if the body has faults.
    std::vector<experiment::NamedChain> variants(const ChainText& text, int most);

  private:
    bool find(const std::string& key, const std::string& name, ChainText& text);

    RequestBody& body_;
    const Roots& roots_;
    const PassRegistry& registry_;
    std::vector<std::string> sets_;
};

}  // namespace postchain::service
