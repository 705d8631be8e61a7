// Finding chains: shipped ones by name, files by path.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "config/chain_file.h"

namespace postchain {

struct ChainText {
    std::string file_name;  // for diagnostics
    std::string text;
    bool shipped = false;
    std::optional<TextNode> root = {};  // a chain inside another text, instead of `text`
};
ChainFile parse_chain(const ChainText& chain, const PassRegistry& registry,
                      const std::vector<std::string>& overrides = {});

// A shipped chain by its name ("paper"), otherwise a file. A name is a word without '/' and '.'. It
// is searched in share/postchain/chains of the installation, then among the copies inside the
// program. Errors: StatusCode::chain, with the shipped names.
Result<ChainText> find_chain(const std::string& name_or_path);
std::vector<std::string> shipped_chains();  // names, sorted

// A chain that another text names (a study, a request of the service): a shipped one, otherwise the
// file at `file_of(name_or_path)`, which gives the path at which a file is opened, or why it must
// not be.
using FileOf = std::function<Result<std::string>(const std::string& path)>;
Result<ChainText> find_named_chain(const std::string& name_or_path, const FileOf& file_of);

// Only the copies inside the program; opens no file.
std::optional<ChainText> embedded_chain(const std::string& name);
std::vector<std::string> embedded_chains();  // names, sorted

// find_chain(), then parse_chain().
Result<ChainFile> load_chain(const std::string& name_or_path, const PassRegistry& registry,
                             const std::vector<std::string>& overrides = {});

}  // namespace postchain
