// Settings of tune, and the table from which the command makes its options.
#pragma once

#include <optional>
#include <string>

#include "chain/parameter.h"
#include "tools/measure/experiment/settings.h"
#include "tools/measure/tune/walk.h"

namespace postchain::tune {

// Tune reads run, input, truth, threads, renderer, repeats and flip of a report's settings.
// `folder` is the chain file.
struct TuneSettings : experiment::ExperimentSettings {
    TuneSettings() { repeats = 3; }
    std::string budget;           // seconds per frame: "0.2", "0.2s", "200ms"; empty = not given
    std::optional<double> error;  // mean HDR-FLIP
    int measure_frames = 3;       // of those with a ground truth, evenly spaced
    int max_chains = 40;          // measured at most
};
const ParameterTable& tune_parameters();  // over TuneSettings

// Errors (usage): both or none given, a budget that is not a time above 0.
Result<Goal> goal_of(const TuneSettings& settings);

}  // namespace postchain::tune
