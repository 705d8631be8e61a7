// postchain.Chain: a parsed chain, which never changes.
#pragma once

#include <pybind11/pybind11.h>

#include <memory>
#include <string>

#include "chain/pass/chain.h"

namespace postchain::python {

struct ChainObject {
    Chain chain;
    std::string name;  // "balanced", "look.yaml", "chain" for a dict
    bool is_file = false;
};
using ChainPtr = std::shared_ptr<const ChainObject>;

// The KEY=VALUE of `set`, a dict or a list of them; or None.
std::vector<std::string> overrides_of(const pybind11::object& set);

// From the text of a chain file. `set`: a dict or a list of KEY=VALUE, as for --set; or None.
// Raises ChainError; warns.
ChainPtr chain_from_text(const std::string& text, const std::string& name,
                         const pybind11::object& set);
// A Chain, a dict, or a shipped name or path.
ChainPtr chain_of(const pybind11::object& source, const pybind11::object& set);

// The result of dict(): {"postchain": 1, "camera": {...}, "passes": [{name: {...}}, ...]}.
pybind11::dict dict_of(const ChainObject& chain);

}  // namespace postchain::python
