// The frames of a run: its outputs and the files each is made from.
#pragma once

#include <functional>
#include <map>
#include <string>
#include <vector>

#include "tools/sequence/settings/run_settings.h"

namespace postchain::sequence {

// One output, made from the files of the same or another frame.
struct FrameTask {
    int frame = 0;                      // of the output
    int source = 0;                     // of the input; differs if a frame is held
    std::map<Role, std::string> files;  // empty = missing
    std::string output;
};

// Called on the reader thread before a frame's first file is opened; an error fails that frame.
using FrameStart = std::function<Status(const FrameTask&)>;

enum class FrameStep { read, filter, write };
const char* name_of(FrameStep step);  // "read", "filtered", "written"

// Called when a step of a frame begins and ends, on the thread of the step. Must not throw.
using StepObserver = std::function<void(FrameStep step, int frame, bool begins)>;

// With --watch and no range, the frames are only known once they have come.
bool frames_are_unknown(const RunSettings& settings);

// The requested frames in order, with the files MissingPolicy gives each. `gaps` gets numbers
// missing on disk that were not requested. `writes`: outputs are written, each under its own name.
// With --watch: the awaited frames without files, or none if unknown. Errors: those that
// run_sequence() finds before reading.
Result<std::vector<FrameTask>> plan_tasks(const RunSettings& settings, bool writes,
                                          std::vector<int>& gaps);

// The missing files of a frame: the color pattern, or the separate planes.
std::string absent_files(int frame, const RunSettings& settings);

// "1-4, 7"; at most `most` numbers and runs of consecutive numbers.
std::string frames_text(const std::vector<int>& frames, size_t most = 20);

}  // namespace postchain::sequence
