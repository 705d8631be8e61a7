// postchain bench: error against run time over the product of sweeps.
//
//   chain x sweeps      --sweep_variants--> variants
//   each frame, variant --GPU--> metrics against the truth, pictures; on some frames flicker and
//                                grid (temporal_stability.h), the error in three parts (converge.h)
//                                                              --> DIR/results/*.json
//   each variant alone  --timing.h--> time of each pass        --> DIR/results/*.json
//   all results         --> means, Pareto set, the cheapest under a limit
//
// A result is kept under the hash of the chain and used again when its key (chain, input and truth
// files, device, settings) is the same: a bench that was killed goes on where it was.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "config/chain_file.h"
#include "tools/measure/experiment/experiment.h"
#include "tools/measure/report/limits.h"

namespace postchain::experiment {

inline constexpr int kMaxVariants = 64;

struct Sweep {
    std::string key;  // "motion_blur.samples"
    std::vector<std::string> values;
};
// "KEY=V1,V2,..."; errors (usage): another form, an empty value.
Result<Sweep> parse_sweep(const std::string& text);

struct BenchVariant {
    std::string name;  // "motion_blur.samples=5 fxaa.preset=10"
    std::vector<std::pair<std::string, std::string>> sweep;
    Chain chain;
};
// The product, the last sweep changing fastest; variants that are the same chain stand once. Keys
// and values are those of --set and give its errors (usage): an unknown key names the nearest.
// Without sweeps: the chain itself. Also (usage): more than `max_variants`.
Result<std::vector<BenchVariant>> sweep_variants(const ChainText& chain,
                                                 const PassRegistry& registry,
                                                 const std::vector<std::string>& sets,
                                                 const std::vector<Sweep>& sweeps,
                                                 int max_variants);

struct BenchSettings : ExperimentSettings {
    std::string chain_name;  // "paper"
    int split_frames = 1;    // frames on which the error is split
};

// Needs the folder prepared (prepare_folder, resuming). A variant that fails keeps its message and
// the others go on. Errors: those of input and truth, (output), (canceled) by `stop`.
Result<report::Report> run_bench(const std::vector<BenchVariant>& variants,
                                 const BenchSettings& settings, Executor& executor,
                                 const ProgressCallback& progress, const std::atomic<bool>* stop);

// Marks the variants that no other beats in both total time and the mean of `metric`.
void mark_pareto(report::Report& report, const std::string& metric);

// For each limit the variant with the least total time whose mean is within it: a line in
// report.under, its chain in DIR/under_METRIC.yaml. False when some limit is met by none.
// Errors (output).
Result<bool> choose_under(report::Report& report, const std::vector<report::MetricLimit>& limits);

}  // namespace postchain::experiment
