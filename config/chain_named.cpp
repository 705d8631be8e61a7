#include "config/chain_named.h"

#include <algorithm>
#include <filesystem>

#include "config/reporter.h"

namespace postchain {

Result<ChainText> find_named_chain(const std::string& name_or_path, const FileOf& file_of) {
    const auto shipped = shipped_chains();
    if (std::find(shipped.begin(), shipped.end(), name_or_path) != shipped.end())
        return find_chain(name_or_path);
    ASSIGN_OR_RETURN(const auto path, file_of(name_or_path));
    std::error_code failed;
    if (name_or_path.find_first_of("/.") == std::string::npos &&
        !std::filesystem::exists(path, failed))
        return Status(StatusCode::chain, unknown_word("chain", name_or_path, shipped));
    return find_chain(path);
}

}  // namespace postchain
