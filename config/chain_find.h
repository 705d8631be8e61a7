// Finding chains: shipped ones by name, files by path.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "config/chain_file.h"

namespace postchain {

struct ChainText {
    std::string file_name;  // for diagnostics
    std::string text;
    bool shipped = false;
};
// A shipped chain by its name ("paper"), else a file. A name is a word without '/' and '.'; the
// folder share/postchain/chains beside the command's own folder is looked at first, then the
// copies inside the program. Errors: StatusCode::chain, with the names there are.
Result<ChainText> find_chain(const std::string& name_or_path);
std::vector<std::string> shipped_chains();  // names, sorted

// The copies inside the program alone; no file is opened.
std::optional<ChainText> embedded_chain(const std::string& name);
std::vector<std::string> embedded_chains();  // names, sorted

// find_chain and parse_chain.
Result<ChainFile> load_chain(const std::string& name_or_path, const PassRegistry& registry,
                             const std::vector<std::string>& overrides = {});

}  // namespace postchain
