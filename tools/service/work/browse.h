// Folders of the roots as a page browses them: folders, sequences, cameras, chains and studies.
#pragma once

#include <string>

#include "tools/service/work/problem.h"

namespace postchain::service {

// JSON, as GET /v1/browse. `folder` is a path of a request; empty: the only root, or a list of the
// roots. Problems: forbidden, not_found.
Answer<std::string> browse(const std::string& folder, const Roots& roots);

// JSON, as GET /v1/chains: the shipped chains, or if `file` is not empty that chain file, each with
// its text. Problems: forbidden, not_found, invalid (not a chain file).
Answer<std::string> chains_of(const std::string& file, const Roots& roots);

}  // namespace postchain::service
