// The frames of a run: which outputs there are to make, and from which files.
#pragma once

#include <functional>
#include <map>
#include <string>
#include <vector>

#include "tools/sequence/run/run_settings.h"

namespace postchain::sequence {

// One output, from the files of one (possibly other) frame.
struct FrameTask {
    int frame = 0;                      // of the output
    int source = 0;                     // of the input; differs where a frame is held
    std::map<Role, std::string> files;  // empty: missing
    std::string output;
};

// Called on the reader thread before the first file of a frame is opened; an error is that frame's.
using FrameStart = std::function<Status(const FrameTask&)>;

// Of a watch without a range: which frames there are is known when they have come.
bool frames_are_unknown(const RunSettings& settings);

// The frames asked for, in their order, with the files that MissingPolicy gives each; `gaps` gets
// the numbers missing on disk that were not asked for. `writes`: outputs are to be made, and have a
// name each. Of a watch: the frames that are waited for, without their files; none where they are
// unknown. Errors: those of run_sequence() that are found before anything is read.
Result<std::vector<FrameTask>> plan_tasks(const RunSettings& settings, bool writes,
                                          std::vector<int>& gaps);

// The files that one frame lacks: of one pattern, or of those planes that have files of their own.
std::string absent_files(int frame, const RunSettings& settings);

// "1, 2, 5", at most twenty of them.
std::string frames_text(const std::vector<int>& frames);

}  // namespace postchain::sequence
