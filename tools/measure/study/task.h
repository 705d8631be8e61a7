// Tasks of a study: the inputs of each, its result on disk, and the call that measures it.
//
//   DIR/scenes/SCENE[/A_vs_B]/   the report of ab or bench       (experiment/)
//   DIR/tasks/TASK.json          its figures and inputs, written whole or not at all
#pragma once

#include <atomic>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "chain/egl/context.h"
#include "tools/measure/experiment/experiment.h"
#include "tools/measure/study/study.h"
#include "tools/measure/study/table.h"
#include "tools/sequence/files/output_files.h"

namespace postchain::study {

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

std::vector<std::string> made_from(const Study& study, const Task& task);

// Relative to the study's folder.
std::string result_path(const Task& task);
std::string claim_path(const Task& task);
std::string report_folder_of(const Study& study, const Task& task);

std::string text_of(const TaskResult& result);
// No value if text_of() did not make `text`.
std::optional<TaskResult> task_result_from(const std::string& text);

// The device on which tasks are measured.
struct Machine {
    Executor& executor;
    std::string renderer;
    bool software = false;
    std::function<Status()> make_current;  // after ground truth was rendered in another context
    egl::ContextOptions options;
    int threads = 0;  // CPU threads; 0 = one per core
    std::vector<std::string> command;
};

// Calls run_ab() or run_bench() and writes the report under `folder`. The result has failures of
// the scene. Errors end the study: (output), (gl), (canceled) by `stop`, (internal).
Result<TaskResult> measure_task(const Study& study, const Task& task, const std::string& folder,
                                const Machine& machine,
                                const experiment::ProgressCallback& progress,
                                const std::atomic<bool>* stop);

}  // namespace postchain::study
