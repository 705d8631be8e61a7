// One frame of a bench: what all variants are given, and what is measured of each.
//
//   frame, its truth, the frame before and its truth --open--> BenchFrame
//   chain --F--> picture --> metrics, tde, flicker and grid, the error in three parts
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
    ImageF color;                          // what the chain made
    std::map<std::string, ImageF> maps;    // kStoredMaps
    const Converged* converged = nullptr;  // where one was made; the frame keeps it
    FrameResult result;
};

class BenchFrame {
  public:
    // `after`: the frame before belongs to the bench too. All but `frame` outlive this.
    // Errors (input): files that cannot be read.
    static Result<BenchFrame> open(const BenchSettings& settings, const Basis& basis,
                                   Executor& executor, RoleSet wanted,
                                   const sequence::SourceFrame& frame, bool after);

    int number() const { return frame_->description.frame_number; }
    const metrics::Picture& input() const { return input_; }
    const std::optional<metrics::Picture>& truth() const { return truth_; }

    // `split`: also the error in three parts; `stability`: also flicker and grid. Errors: those of
    // planning and of the executor.
    Result<Findings> measure(const Chain& chain, bool split, bool stability);
    // The unfiltered input against the truth, which there must be.
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
    metrics::Picture input_;
    std::optional<metrics::Picture> truth_;
    // Results of earlier frames are not held in memory, but made again.
    std::optional<sequence::SourceFrame> frame_before_;
    std::optional<metrics::Picture> truth_before_;
    std::map<std::string, Converged> converged_;  // by the text of the converged chain
};

}  // namespace postchain::experiment
