// The files of a run: what it reads and what it will write, for the rule of
// tools/sequence/files/output_files.h.
#pragma once

#include <string>
#include <vector>

#include "chain/chain.h"
#include "tools/sequence/files/output_files.h"
#include "tools/sequence/run/frame_task.h"

namespace postchain::sequence {

// Every frame on disk counts as read, asked for or not: others are its neighbors.
io::OutputFiles files_of_run(const Chain& chain, const RunSettings& settings,
                             const std::vector<FrameTask>& tasks);

// What is written for one frame, but its stages: picture, sidecar, preview.
std::vector<std::string> outputs_of(const FrameTask& task, const RunSettings& settings);

// Of a stage with the name that it has in the plan: "DIR/0.motion_blur.tile_max.0001.exr".
std::string stage_path(const std::string& folder, const std::string& stage, int frame);

// What a program reads for its frames: the patterns of the input and the other files.
void read_inputs(const RunSettings& settings, io::OutputFiles& files);

}  // namespace postchain::sequence
