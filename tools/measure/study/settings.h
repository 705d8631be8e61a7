// What a study is told besides its file, and the table of it.
#pragma once

#include <string>

#include "chain/parameter.h"
#include "tools/sequence/files/atomic_file.h"

namespace postchain::study {

struct StudySettings {
    std::string folder;
    std::string chunk;  // "2/4" of the units; empty: all
    io::OnExisting on_existing = io::OnExisting::skip;
};
// Rows of the group kSplitGroup are for who splits a study by hand.
inline constexpr const char* kSplitGroup = "split";
const ParameterTable& study_parameters();

}  // namespace postchain::study
