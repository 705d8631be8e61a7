#include "tools/sequence/layers/crypto_names.h"

#include <fnmatch.h>

#include <algorithm>

#include "chain/parameter.h"
#include "chain/text.h"
#include "config/layer_match.h"

namespace postchain::sequence {

std::vector<io::CryptoId> ids_named(const io::Cryptomatte& cryptomatte, const std::string& word) {
    std::vector<io::CryptoId> ids;
    for (const auto& [name, id] : cryptomatte.manifest)
        if (name == word || (is_pattern(word) && ::fnmatch(word.c_str(), name.c_str(), 0) == 0))
            ids.push_back(id);
    return ids;
}

std::string unknown_id_text(const std::string& word, std::vector<std::string> known) {
    const std::string near = nearest_word(word, known);
    if (!near.empty())
        return concat("no '", word, "' in the cryptomatte (did you mean '", near, "'?)");
    if (known.empty()) return concat("no '", word, "': the file has no cryptomatte with names");
    constexpr size_t kShown = 40;
    const size_t all = known.size();
    if (all > kShown) known.resize(kShown);
    return concat("no '", word, "' in the cryptomatte; it has ", joined(known),
                  all > kShown ? ", ..." : "");
}

Result<std::vector<std::vector<io::CryptoId>>> ids_of_names(
    const std::vector<std::string>& words, const std::vector<io::Cryptomatte>& cryptomattes,
    std::vector<std::string>& warnings) {
    std::vector<std::vector<io::CryptoId>> found(cryptomattes.size());
    for (const std::string& word : words) {
        bool any = false;
        std::vector<std::string> known;
        for (size_t i = 0; i < cryptomattes.size(); ++i) {
            const io::Cryptomatte& one = cryptomattes[i];
            auto ids = ids_named(one, word);
            if (one.manifest.empty() && !is_pattern(word)) {
                ids.push_back(io::id_of_name(word));
                warnings.push_back(concat("cryptomatte ", one.name, ": ", one.no_manifest, ": '",
                                          word, "' is found by the hash of its name"));
            }
            any = any || !ids.empty();
            found[i].insert(found[i].end(), ids.begin(), ids.end());
            for (const auto& [name, id] : one.manifest) known.push_back(name);
        }
        if (!any) return Status(StatusCode::input, unknown_id_text(word, std::move(known)));
    }
    for (auto& ids : found) {
        std::sort(ids.begin(), ids.end());
        ids.erase(std::unique(ids.begin(), ids.end()), ids.end());
    }
    return found;
}

}  // namespace postchain::sequence
