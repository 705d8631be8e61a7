// Small sequences on disk, and settings of an experiment over them.
#pragma once

#include <string>

#include "tests/command/frames.h"
#include "tests/support/gpu.h"
#include "tests/support/temp_folder.h"
#include "tools/measure/experiment/run_experiment.h"

namespace postchain::test {

// Frames 1..count of layered_frame(), 64 x 40, each with another texture, in Cycles' convention:
// FOLDER/in.####.exr with color, depth and motion vectors.
void write_sequence(const std::string& folder, int count);
// FOLDER/truth.####.exr of the frames from `first` on, color only: the input's color plus `offset`
// in every channel.
void write_truth(const std::string& folder, int first, int count, float offset, int height = 40);

// Motion blur of 5 taps, then FXAA; needs no camera.
extern const char* const kChainText;
extern const char* const kOtherOrderText;
Chain parse(const std::string& text, const std::vector<std::string>& sets = {});

// Variants of kChainText; parameters as in experiment::sweep_variants().
Result<std::vector<experiment::NamedChain>> sweep(const std::vector<std::string>& texts,
                                                  int limit = 64,
                                                  const std::vector<std::string>& sets = {});

// Each series of `some` is in `all`, with the same values up to 1e-6. Returns how many values.
size_t expect_same_values(const report::Metrics& some, const report::Metrics& all);

experiment::ExperimentSettings settings_for(const std::string& folder, const std::string& report);

}  // namespace postchain::test
