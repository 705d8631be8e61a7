// Settings of a study outside its file, and their table.
#pragma once

#include <string>

#include "chain/parameter.h"
#include "tools/sequence/files/atomic_file.h"

namespace postchain::study {

struct StudySettings {
    std::string folder;
    std::string chunk;  // "2/4" of the tasks; empty: all
    io::OnExisting on_existing = io::OnExisting::skip;
};
// Rows of the group kSplitGroup split a study by hand.
inline constexpr const char* kSplitGroup = "split";
const ParameterTable& study_parameters();

}  // namespace postchain::study
