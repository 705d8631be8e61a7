// The folder of a study; any number of processes may work in it at a time.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "tools/measure/study/task.h"
#include "tools/sequence/files/output_files.h"

namespace postchain::study {

inline constexpr const char* kStudyMark = ".postchain-study";

class StudyFolder {
  public:
    // Creates it, or continues in one that has the mark. `on_existing`: fail if results exist; skip
    // keeps them; overwrite removes them first. Errors (usage): an input is in it, results of
    // another study or of other files; (output).
    static Result<StudyFolder> open(const Study& study, const std::string& path,
                                    io::OnExisting on_existing);

    const std::string& path() const { return path_; }
    // No value if no result exists yet. Errors (usage): a result of another study or of other
    // files, with the first line that differs; (input): the file cannot be read.
    Result<std::optional<TaskResult>> result(const Study& study, const Task& task) const;
    Status keep(const Task& task, const TaskResult& result) const;
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
