// The folder of a study, in which any number of processes may work at a time.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "tools/measure/study/unit.h"
#include "tools/sequence/files/output_files.h"

namespace postchain::study {

inline constexpr const char* kStudyMark = ".postchain-study";

class StudyFolder {
  public:
    // Makes it, or goes on in one that bears the mark. `on_existing`: fail, where results are
    // there; skip: they are kept; overwrite: they are removed first. Errors (usage): an input lies
    // in it, results of another study or of other files; (output).
    static Result<StudyFolder> open(const Study& study, const std::string& path,
                                    io::OnExisting on_existing);

    const std::string& path() const { return path_; }
    // Nothing while there is none. Errors (usage): of another study or of other files, with the
    // first line that differs; (input): the file cannot be read.
    Result<std::optional<UnitResult>> result(const Study& study, const Unit& unit) const;
    Status keep(const Unit& unit, const UnitResult& result) const;
    // A file of the folder, whole or not at all. Errors (output).
    Status write(const std::string& name, std::string_view text) const;

  private:
    StudyFolder(std::string path, io::OutputFiles files)
        : path_(std::move(path)), files_(std::move(files)) {}
    Status check_results(const Study& study) const;
    std::string path_;
    io::OutputFiles files_;
};

}  // namespace postchain::study
