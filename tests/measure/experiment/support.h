// Small sequences on disk, and settings of an experiment over them.
#pragma once

#include <string>

#include "tests/support/gpu.h"
#include "tests/support/temp_folder.h"
#include "tools/measure/experiment/run_experiment.h"

namespace postchain::test {

// Frames first..first+count-1 of layered_frame(), each with another texture, in Cycles' convention:
// FOLDER/in.####.exr with color, depth and motion vectors.
void write_sequence(const std::string& folder, int first, int count, int width = 64,
                    int height = 40);
// FOLDER/NAME.####.exr, color only: the input's color plus `offset` in every channel.
void write_truth(const std::string& folder, const std::string& name, int first, int count,
                 float offset, int width = 64, int height = 40);
void write_rgb(const std::string& path, const ImageF& rgb);

// Motion blur of 5 taps, then FXAA; needs no camera.
extern const char* const kChainText;
extern const char* const kOtherOrderText;
Chain parse(const std::string& text, const std::vector<std::string>& sets = {});

// Variants of kChainText; parameters as in experiment::sweep_variants().
Result<std::vector<experiment::NamedChain>> sweep(const std::vector<std::string>& texts,
                                                  int limit = 64,
                                                  const std::vector<std::string>& sets = {});

experiment::ExperimentSettings settings_for(const std::string& folder, const std::string& report);

}  // namespace postchain::test
