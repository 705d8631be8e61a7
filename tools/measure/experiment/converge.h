// The same filter converged, and the error of a variant in three parts.
//
//   chain --rows of Convergence::set at their converged value--> many taps
//         --rows of Convergence::averaged at many values, GPU, fp32--> mean picture C, scatter
//
//   G = the variant on the GPU, R = its double reference (same taps, same random values),
//   C = converged, T = truth:   G - T = (G - R) + (R - C) + (C - T)
//                                     precision   sampling   model
// Which rows converge, and where, is in the passes' parameter tables (chain/parameter.h).
// Described in docs/report.md, "bench".
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "chain/gl/executor.h"
#include "chain/planner.h"
#include "tools/measure/experiment/experiment.h"

namespace postchain::experiment {

inline constexpr int kConvergedSeeds = 4;

// A copy with every converging row at its converged value; `changes` says which those are.
Chain converged_chain(const Chain& chain, std::vector<std::string>* changes);
// A copy whose averaged rows are moved on by `offset` (round their range); same chain: none.
Chain with_seed_offset(const Chain& chain, int offset);
bool has_seeds(const Chain& chain);
// Has some pass of it a row that converges? If none has, the filter is what it converges to.
bool samples(const Chain& chain);

struct Converged {
    ImageF rgb;           // mean over the seeds, 3 channels
    bool sampled = true;  // false: no pass of the chain samples, C is R by definition
    int seeds = 0;        // 1 where nothing is random
    double noise = 0;     // MSE that is left in the mean: variance over seeds / seeds
    std::vector<std::string> changes;
};
// Errors: those of planning and of the executor.
Result<Converged> converge(const Chain& chain, const FrameDescription& frame, PlaneView planes,
                           const PlanOptions& options, Executor& executor,
                           int seeds = kConvergedSeeds);

// Where the chain does not sample the sampling error is 0 by definition, and C = R.
// `gpu`, `reference` (>= 3 channels), `converged` and `truth` are of one size; no truth: no model
// and no total. Errors (input): sizes that differ.
Result<report::ErrorSplit> split_error(int frame, const ImageF& gpu, const ImageD& reference,
                                       const Converged& converged, const metrics::Picture* truth,
                                       const metrics::ExposureRange& exposures,
                                       const metrics::FlipSettings& flip);

// Mean of the splits of several frames of one variant.
report::ErrorSplit mean_split(const std::vector<report::ErrorSplit>& splits);

}  // namespace postchain::experiment
