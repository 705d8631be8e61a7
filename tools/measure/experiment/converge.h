// Converges a filter and splits a variant's error into three parts.
//
//   chain --rows of Convergence::set at their converged value--> many taps
//         --rows of Convergence::averaged at many values, GPU, fp32--> mean image C, variance
//
//   G = the variant on the GPU, R = its double reference (same taps, same random values),
//   C = converged, T = ground truth:   G - T = (G - R) + (R - C) + (C - T)
//                                            precision   sampling   model
// The passes' parameter tables (chain/base/parameter.h) state which rows converge, and their
// values. Described in docs/report.md, "bench".
#pragma once

#include <string>
#include <vector>

#include "chain/gl/executor.h"
#include "chain/pass/planner.h"
#include "tools/measure/experiment/experiment.h"

namespace postchain::experiment {

inline constexpr int kConvergedSeeds = 4;

// A copy of the chain with every converging row at its converged value; `changes` lists these rows.
Chain converged_chain(const Chain& chain, std::vector<std::string>* changes);
// A copy with the averaged rows moved by `offset` (wrapping); equal to `chain` if there are none.
Chain with_seed_offset(const Chain& chain, int offset);
bool has_seeds(const Chain& chain);
// Whether a pass has a converging row. If none has, the filter is its own converged version.
bool samples(const Chain& chain);

struct Converged {
    ImageF rgb;           // mean over the seeds, 3 channels
    bool sampled = true;  // false: no pass of the chain samples, so C = R
    int seeds = 0;        // 1 if nothing is random
    double noise = 0;     // MSE left in the mean: variance over seeds / seeds
    std::vector<std::string> changes;
};
// Errors: those of planning and of the executor.
Result<Converged> converge(const Chain& chain, const FrameDescription& frame, PlaneView planes,
                           const PlanOptions& options, Executor& executor,
                           int seeds = kConvergedSeeds);

// If the chain does not sample, the sampling error is 0 by definition, and C = R. `gpu`,
// `reference` (>= 3 channels), `converged` and `truth` have one size; without a truth there is no
// model error and no total. Errors (input): different sizes.
Result<report::ErrorSplit> split_error(int frame, const ImageF& gpu, const ImageD& reference,
                                       const Converged& converged, const metrics::RgbImage* truth,
                                       const metrics::ExposureRange& exposures,
                                       const metrics::FlipSettings& flip);

report::ErrorSplit mean_split(const std::vector<report::ErrorSplit>& splits);

}  // namespace postchain::experiment
