// Lists the files that a run reads and will write, for the rule of
// tools/sequence/files/output_files.h.
#pragma once

#include <string>
#include <vector>

#include "chain/pass/chain.h"
#include "tools/sequence/files/output_files.h"
#include "tools/sequence/settings/run_settings.h"

namespace postchain::sequence {

// Every frame on disk is treated as read, requested or not, because it may be a neighbor. If this
// thread's work is stopped (chain/base/stop.h), files are missing, and their checks say so.
io::OutputFiles files_of_run(const Chain& chain, const RunSettings& settings,
                             const std::vector<FrameTask>& tasks);

// The files written for one frame, except stages: image, sidecar, preview.
std::vector<std::string> outputs_of(const FrameTask& task, const RunSettings& settings);

// File of a stage, by its name in the plan: "DIR/0.motion_blur.tile_max.0001.exr".
std::string stage_path(const std::string& folder, const std::string& stage, int frame);

// Adds the files a program reads for its frames: the input patterns and the other input files.
void read_inputs(const RunSettings& settings, io::OutputFiles& files);

}  // namespace postchain::sequence
