// The folder of a study, and the results of its tasks; any number of processes may work in it at a
// time.
//
//   DIR/scenes/SCENE[/A_vs_B]/   the report of ab or bench       (experiment/)
//   DIR/tasks/TASK.json          its figures and inputs, written whole or not at all
#pragma once

#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "tools/measure/study/study.h"
#include "tools/measure/study/table.h"
#include "tools/sequence/files/output_files.h"

namespace postchain::study {

inline constexpr const char* kStudyMark = ".postchain-study";

struct TaskResult {
    // Lines: version, chains, settings, size and time of every file that is read. Results with
    // equal lines are equal, except for rounding of other devices.
    std::vector<std::string> made_from;
    std::string failure;  // why the scene could not be measured; then the rest is empty
    std::string renderer;
    std::string revision;  // commit of the program's source
    std::string truth;     // as in the report
    std::vector<int> frames;
    int width = 0, height = 0;  // pixels
    struct Figures {
        std::string name;
        std::map<std::string, Values> metrics;  // per frame
        std::optional<double> time_ms;          // time of one frame
    };
    std::vector<Figures> variants;
};

// Two of ab, all of bench.
std::vector<const experiment::NamedChain*> chains_of(const Study& study, const Task& task);
std::vector<std::string> made_from(const Study& study, const Task& task);

// Relative to the study's folder.
std::string result_path(const Task& task);
std::string claim_path(const Task& task);
std::string report_folder_of(const Study& study, const Task& task);

std::string text_of(const TaskResult& result);
// No value if text_of() did not make `text`.
std::optional<TaskResult> task_result_from(const std::string& text);

class StudyFolder {
  public:
    // Creates it, or continues in one that has the mark. `on_existing`: fail if results exist; skip
    // keeps them; overwrite removes them first. Errors (usage): an input is in it, results of
    // another study or of other files; (output).
    static Result<StudyFolder> open(const Study& study, const std::string& path,
                                    io::OnExisting on_existing);

    // The refusals of open(), without a change on disk.
    static Status check(const Study& study, const std::string& path, io::OnExisting on_existing);

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
