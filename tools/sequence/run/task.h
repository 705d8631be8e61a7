// What a run has to make: its outputs, from which files, and whether that is done already.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "tools/sequence/run/runner.h"

namespace postchain::sequence {

// What is to be made: one output, from the files of one (possibly other) frame.
struct Task {
    int frame = 0;                      // of the output
    int source = 0;                     // of the input; differs where a frame is held
    std::map<Role, std::string> files;  // empty: missing
    std::string output;
};

// The frames asked for, in their order, with the files that MissingPolicy gives each; `gaps` gets
// the holes that nobody asked for. `writes`: outputs are to be made, so that their names matter.
// Errors: those of run_sequence() that are found before anything is read.
Result<std::vector<Task>> plan_tasks(const RunSettings& settings, bool writes,
                                     std::vector<int>& gaps);

// The files that one frame lacks: of one pattern, or of those planes that have files of their own.
std::string absent_files(int frame, const RunSettings& settings);

// Existing outputs that OnExisting::fail would find one by one.
Status check_none_exists(const std::vector<Task>& tasks, const RunSettings& settings);

// Output, sidecar and preview are there, whole and of this very work (work_text()).
bool same_work_done(const Task& task, const std::string& work, const RunSettings& settings);

// OUT.png beside OUT.exr.
std::string preview_path(const std::string& output);

}  // namespace postchain::sequence
