// postchain tune: finds the chain of least error within a time per frame, or of least time within
// an error, on a few frames of a shot and on this device.
//
//   start chains --pareto_search.h--> chains measured on the frames --> front, chosen chain
//   a chain: its error against the ground truth, or against the start's own converged image
//
// Metric, exposures and timing are those of bench (tools/measure/experiment).
#pragma once

#include <atomic>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "chain/base/parameter.h"
#include "chain/gl/executor.h"
#include "tools/measure/experiment/experiment.h"
#include "tools/measure/experiment/settings.h"
#include "tools/measure/tune/pareto_search.h"

namespace postchain::tune {

// Tune reads run, input, truth, threads, renderer, repeats and flip of a report's settings.
// `folder` is the chain file.
struct TuneSettings : experiment::ExperimentSettings {
    TuneSettings() { repeats = 3; }
    std::string budget;           // seconds per frame: "0.2", "0.2s", "200ms"; empty = not given
    std::optional<double> error;  // mean HDR-FLIP
    int measure_frames = 3;       // evenly spaced frames with a ground truth
    int max_chains = 40;          // measured at most
};
const ParameterTable& tune_parameters();  // over TuneSettings

// Errors (usage): both or none given, a budget that is not a time above 0.
Result<Goal> goal_of(const TuneSettings& settings);

// Shipped chains to start from if none is named.
std::vector<std::string> default_starts(bool with_truth);

// The measured chains of a stopped walk, from which it continues.
struct StoppedWalk {
    struct Point {
        Measured measured;
        bool confirmed = false;  // the times come from time_again()
    };
    std::string key;                    // hash of everything that the figures depend on
    std::map<uint64_t, Point> by_hash;  // by the chain's hash
};

struct Tuning {
    Goal goal;
    ParetoSearch search;
    std::string key;  // as StoppedWalk::key
    // The conditions of the figures, in words.
    std::string version;
    std::string input;      // as typed
    std::string frames;     // "10, 12; 640x360"
    std::string reference;  // "ground truth both.####.exr", or what the converged image is
    bool with_truth = false;
    std::string device;
    std::string timing;  // "wall clock around glFinish, median of 3 repetitions"
    std::vector<std::string> notes;

    const Candidate* chosen() const {
        return search.chosen ? &search.candidates[*search.chosen] : nullptr;
    }
};

// `fixed`: knobs that stay as they are. With a ground truth the search also changes the order of
// the passes; without it there is one start, whose own converged image is the reference. Writes
// nothing. If no chain meets the goal, Tuning::chosen() is null. `earlier`: chains that are not
// measured again. Errors: (usage); (input) of the shot and the ground truth; those of planning;
// (gl); (output): `earlier` has another key; (canceled) by `stop` before anything was measured:
// later the search has `stopped`.
Result<Tuning> run_tune(std::vector<Start> starts, const std::vector<std::string>& fixed,
                        const TuneSettings& settings, Executor& executor,
                        const experiment::ProgressCallback& progress, const std::atomic<bool>* stop,
                        const StoppedWalk* earlier = nullptr);

}  // namespace postchain::tune
