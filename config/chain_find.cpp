#include "config/chain_find.h"

#include <sys/stat.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <set>

#include "chain/base/text.h"
#include "config/embedded.h"
#include "config/reporter.h"
#include "config/text_tree.h"

namespace postchain {
namespace {

namespace fs = std::filesystem;

// share/postchain/chains of the installation that contains this program.
fs::path installed_folder() {
    std::error_code failed;
    const fs::path program = fs::read_symlink("/proc/self/exe", failed);
    if (failed) return {};
    return program.parent_path().parent_path() / "share/postchain/chains";
}

bool is_name(const std::string& text) {
    return !text.empty() && text.find_first_of("/.") == std::string::npos;
}

// "chains/paper.yaml" -> "paper"; empty for other files.
std::string chain_name(std::string_view path) {
    if (!path.starts_with("chains/") || !path.ends_with(".yaml")) return {};
    return std::string(path.substr(7, path.size() - 12));
}

}  // namespace

std::optional<ChainText> embedded_chain(const std::string& name) {
    for (const auto& file : embedded_config())
        if (!name.empty() && chain_name(file.path) == name)
            return ChainText{std::string(file.path), std::string(file.text), true};
    return std::nullopt;
}

std::vector<std::string> embedded_chains() {
    std::set<std::string> names;
    for (const auto& file : embedded_config())
        if (const std::string name = chain_name(file.path); !name.empty()) names.insert(name);
    return {names.begin(), names.end()};
}

std::vector<std::string> shipped_chains() {
    const std::vector<std::string> embedded = embedded_chains();
    std::set<std::string> names(embedded.begin(), embedded.end());
    std::error_code failed;
    for (fs::directory_iterator it(installed_folder(), failed), end; !failed && it != end;
         it.increment(failed))
        if (it->path().extension() == ".yaml") names.insert(it->path().stem().string());
    return {names.begin(), names.end()};
}

Result<ChainText> find_chain(const std::string& name_or_path) {
    std::error_code failed;
    if (is_name(name_or_path)) {
        const fs::path installed = installed_folder() / (name_or_path + ".yaml");
        if (fs::is_regular_file(installed, failed)) {
            ASSIGN_OR_RETURN(const auto text,
                             read_text_file(installed.string(), StatusCode::chain));
            return ChainText{installed.string(), text, true};
        }
        if (auto embedded = embedded_chain(name_or_path)) return std::move(*embedded);
    }
    struct stat info;
    if (::stat(name_or_path.c_str(), &info) != 0 && errno != ENOENT)
        return Status(StatusCode::chain,
                      concat(name_or_path, ": cannot be opened: ", std::strerror(errno)));
    if (!fs::exists(name_or_path, failed)) {
        const std::vector<std::string> names = shipped_chains();
        const std::string near = nearest_word(name_or_path, names);
        return Status(StatusCode::chain,
                      name_or_path + ": not a file and not a shipped chain; shipped chains are " +
                          joined(names) + (near.empty() ? "" : " (did you mean '" + near + "'?)"));
    }
    ASSIGN_OR_RETURN(const auto text, read_text_file(name_or_path, StatusCode::chain));
    return ChainText{name_or_path, text, false};
}

Result<ChainText> find_named_chain(const std::string& name_or_path, const FileOf& file_of) {
    const auto shipped = shipped_chains();
    if (std::find(shipped.begin(), shipped.end(), name_or_path) != shipped.end())
        return find_chain(name_or_path);
    ASSIGN_OR_RETURN(const auto path, file_of(name_or_path));
    std::error_code failed;
    if (name_or_path.find_first_of("/.") == std::string::npos && !fs::exists(path, failed))
        return Status(StatusCode::chain, unknown_word("chain", name_or_path, shipped));
    return find_chain(path);
}

ChainFile parse_chain(const ChainText& chain, const PassRegistry& registry,
                      const std::vector<std::string>& overrides) {
    return chain.root ? parse_chain(*chain.root, chain.file_name, registry, overrides)
                      : parse_chain(chain.text, chain.file_name, registry, overrides);
}

Result<ChainFile> load_chain(const std::string& name_or_path, const PassRegistry& registry,
                             const std::vector<std::string>& overrides) try {
    ASSIGN_OR_RETURN(const ChainText found, find_chain(name_or_path));
    return parse_chain(found, registry, overrides);
} catch (...) {
    return status_of_exception(name_or_path);
}

}  // namespace postchain
