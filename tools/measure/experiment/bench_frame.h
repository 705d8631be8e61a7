// One frame of a bench: the inputs of all variants, and the measurements of each.
//
//   frame, its ground truth, the previous frame and its ground truth --open--> BenchFrame
//   chain --F--> image --> metrics, tde, flicker and grid, the error in three parts
#pragma once

#include <map>
#include <optional>
#include <string>

#include "tools/measure/experiment/basis.h"
#include "tools/measure/experiment/bench.h"
#include "tools/measure/experiment/bench_store.h"
#include "tools/measure/experiment/converge.h"

namespace postchain::experiment {

struct Findings {
    ImageF color;                          // output of the chain
    std::map<std::string, ImageF> maps;    // kStoredMaps
    const Converged* converged = nullptr;  // owned by the frame; null if not made
    FrameResult result;
};

class BenchFrame {
  public:
    // `after`: the previous frame belongs to the bench too. All arguments except `frame` must
    // outlive the object. Errors (input): files that cannot be read.
    static Result<BenchFrame> open(const BenchSettings& settings, const Basis& basis,
                                   Executor& executor, RoleSet wanted,
                                   const sequence::SourceFrame& frame, bool after);

    int number() const { return frame_->description.frame_number; }
    const metrics::RgbImage& input() const { return input_; }
    const std::optional<metrics::RgbImage>& truth() const { return truth_; }

    // `split`: also split the error in three parts; `stability`: also measure flicker and grid.
    // Errors: those of planning and of the executor.
    Result<Findings> measure(const Chain& chain, bool split, bool stability);
    // Measures the unfiltered input against the ground truth, which must exist.
    Result<Findings> measure_input() const;

  private:
    BenchFrame(const BenchSettings& settings, const Basis& basis, Executor& executor)
        : settings_(&settings), basis_(&basis), executor_(&executor) {}
    Result<ImageF> filtered(const Chain& chain, const sequence::SourceFrame& frame,
                            std::vector<Elision>* elisions);
    Result<const Converged*> converge_once(const Chain& chain);
    Status measure_step(const ImageF& before, const metrics::Pair& pair, FrameResult& result) const;

    const BenchSettings* settings_;
    const Basis* basis_;
    Executor* executor_;
    const sequence::SourceFrame* frame_ = nullptr;
    metrics::RgbImage input_;
    std::optional<metrics::RgbImage> truth_;
    // Results of earlier frames are recomputed instead of kept in memory.
    std::optional<sequence::SourceFrame> frame_before_;
    std::optional<metrics::RgbImage> truth_before_;
    std::map<std::string, Converged> converged_;  // by the converged chain's text
};

}  // namespace postchain::experiment
