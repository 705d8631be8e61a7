// Reads the file of a study. Format: docs/studies.md.
#pragma once

#include <functional>
#include <string>
#include <string_view>

#include "chain/pass/pass.h"
#include "config/diagnostic.h"
#include "config/text_tree.h"
#include "tools/measure/study/study.h"

namespace postchain::study {

inline constexpr int kStudyFileVersion = 1;
inline constexpr size_t kMaxTasks = 10000;

// Resolves the paths of a study. Errors are reported at the place of the path in the file.
struct StudyPaths {
    std::function<Result<std::string>(const std::string&)> file;
    std::function<Result<io::PathPattern>(const io::PathPattern&)> pattern;
};
// Relative to the folder of the study's file.
StudyPaths paths_beside(const std::string& study_file);

struct StudyFile {
    Study study;  // what could be read; run it only when status() is ok
    Diagnostics diagnostics;
    Status status() const { return status_of(diagnostics); }
};
// Reads chains, cameras and profiles too, but no frame. Errors: (usage) in the text, (chain) and
// (input) in the files that it names.
StudyFile read_study(std::string_view text, const std::string& file_name,
                     const PassRegistry& registry, const StudyPaths& paths,
                     const std::string& version);
// A study inside another text, which has been read already.
StudyFile read_study(const TextNode& root, const std::string& file_name,
                     const PassRegistry& registry, const StudyPaths& paths,
                     const std::string& version);

}  // namespace postchain::study
