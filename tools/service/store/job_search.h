// The search of the list of jobs.
#pragma once

#include <string>
#include <vector>

namespace postchain::service {

// The words of a search; at most 16.
std::vector<std::string> words_of(const std::string& search);
// " AND ..." for a query of jobs: each of the words, bound from parameter `first` on, occurs in the
// job's id, kind, state, owner, message, input, output, camera, chains or study. Case does not
// matter (ASCII).
std::string search_condition(size_t words, int first);

}  // namespace postchain::service
