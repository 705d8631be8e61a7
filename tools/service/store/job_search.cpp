#include "tools/service/store/job_search.h"

#include <sstream>

#include "chain/status.h"
#include "chain/text.h"

namespace postchain::service {

std::vector<std::string> words_of(const std::string& search) {
    constexpr size_t kMaxWords = 16;
    std::istringstream text(search);
    std::vector<std::string> words;
    for (std::string word; words.size() < kMaxWords && text >> word;) words.push_back(word);
    return words;
}

std::string search_condition(size_t words, int first) {
    std::string text = "lower(id || ' ' || kind || ' ' || state || ' ' || owner || ' ' || message";
    for (const char* key : {"input", "output", "chain", "chain_b", "study", "camera"})
        text += concat(" || ' ' || CASE WHEN json_valid(body) THEN IFNULL(json_extract(body, '$.",
                       key, "'), '') ELSE '' END");
    text += ")";
    std::string condition;
    for (size_t i = 0; i < words; ++i)
        condition += concat(" AND instr(", text, ", lower(?", first + int(i), ")) > 0");
    return condition;
}

}  // namespace postchain::service
