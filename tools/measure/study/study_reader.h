// The file of a study, read. Format: docs/studies.md.
#pragma once

#include <functional>
#include <string>
#include <string_view>

#include "chain/pass.h"
#include "config/diagnostic.h"
#include "config/text_tree.h"
#include "tools/measure/study/study.h"

namespace postchain::study {

inline constexpr int kStudyFileVersion = 1;
inline constexpr size_t kMaxUnits = 10000;

// Where the paths of a study lead. A failure's message is put at the place of the text.
struct StudyPaths {
    std::function<Result<std::string>(const std::string&)> file;
    std::function<Result<io::PathPattern>(const io::PathPattern&)> pattern;
};
// From the folder of the study's file.
StudyPaths paths_beside(const std::string& study_file);

struct StudyFile {
    Study study;  // what could be read; run it only when status() is ok
    Diagnostics diagnostics;
    Status status() const { return status_of(diagnostics); }
};
// Reads chains, cameras and profiles too, but no frame. Errors: (usage) what is wrong in the text,
// (chain) and (input) what is wrong in the files that it names.
StudyFile read_study(std::string_view text, const std::string& file_name,
                     const PassRegistry& registry, const StudyPaths& paths,
                     const std::string& version);
// A study inside another text, which has been read already.
StudyFile read_study(const TextNode& root, const std::string& file_name,
                     const PassRegistry& registry, const StudyPaths& paths,
                     const std::string& version);

}  // namespace postchain::study
