// Ids of a cryptomatte by the names in its manifest, for mattes and for `--cryptomatte
// filter=NAMES`.
#pragma once

#include <string>
#include <vector>

#include "tools/sequence/frame/cryptomatte.h"

namespace postchain::sequence {

// Ids whose name is `word` or matches it as a pattern.
std::vector<io::CryptoId> ids_named(const io::Cryptomatte& cryptomatte, const std::string& word);

// Says that no id is called `word`, with the closest of the known names, or all of them.
std::string unknown_id_text(const std::string& word, std::vector<std::string> known);

// The ids with these names or patterns in each cryptomatte, sorted. Without a manifest a name is
// found by its hash, and `warnings` says so. Errors (input): a word that no cryptomatte knows.
Result<std::vector<std::vector<io::CryptoId>>> ids_of_names(
    const std::vector<std::string>& words, const std::vector<io::Cryptomatte>& cryptomattes,
    std::vector<std::string>& warnings);

}  // namespace postchain::sequence
