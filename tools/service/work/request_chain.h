#pragma once

#include <string>
#include <vector>

#include "chain/pass/pass.h"
#include "config/chain_find.h"
#include "tools/service/work/request_body.h"

namespace postchain::service {

struct NamedChain {
    std::string name;  // "paper"; of a text or an object its key
    Chain chain;       // after `set`
};

// The chains of a request: named, in a file, an object or a text; with the overrides of `set`.
class ChainReader {
  public:
    // The arguments outlive this object. Reads `set`.
    ChainReader(RequestBody& body, const Roots& roots, const PassRegistry& registry);

    // The chain of KEY or KEY_text.
    void read(const std::string& key, NamedChain& chain, ChainText& text);
    // The overrides of `set`, whose paths are resolved.
    const std::vector<std::string>& sets() const { return sets_; }

  private:
    bool find(const std::string& key, const std::string& name, ChainText& text);

    RequestBody& body_;
    const Roots& roots_;
    const PassRegistry& registry_;
    std::vector<std::string> sets_;
};

}  // namespace postchain::service
