#include "tools/measure/experiment/bench_frame.h"

#include "chain/planner.h"
#include "tools/measure/experiment/temporal_stability.h"
#include "tools/measure/metrics/temporal.h"
#include "tools/sequence/source/frame_plan.h"

namespace postchain::experiment {

Result<BenchFrame> BenchFrame::open(const BenchSettings& settings, const Basis& basis,
                                    Executor& executor, RoleSet wanted,
                                    const sequence::SourceFrame& frame, bool after) {
    BenchFrame made(settings, basis, executor);
    made.frame_ = &frame;
    ASSIGN_OR_RETURN(made.input_, metrics::rgb_image_of(*frame.planes.at(Role::color)));
    if (!basis.truth || !basis.truth->has(made.number())) return made;
    auto truth = basis.truth->load(made.number());
    if (!truth.ok()) return truth.status();
    made.truth_ = std::move(*truth);
    if (!after) return made;
    ASSIGN_OR_RETURN(made.frame_before_,
                     read_frame(basis, settings.run, made.number() - 1, wanted));
    truth = basis.truth->load(made.number() - 1);
    if (!truth.ok()) return truth.status();
    made.truth_before_ = std::move(*truth);
    return made;
}

Result<ImageF> BenchFrame::filtered(const Chain& chain, const sequence::SourceFrame& frame,
                                    std::vector<Elision>* elisions) {
    ASSIGN_OR_RETURN(auto plan, sequence::plan_source_frame(chain, frame, settings_->run.plan));
    ASSIGN_OR_RETURN(auto result, executor_->filter(plan, frame.planes));
    if (elisions)
        for (const Elision& elision : plan.elisions)
            if (const auto found = found_in(elision, plan, executor_->work_done()))
                elisions->push_back(*found);
    return std::move(result.at(Role::color));
}

// Variants that differ only in converging rows share one converged image.
Result<const Converged*> BenchFrame::converge_once(const Chain& chain) {
    const std::string text = converged_chain(chain, nullptr).text();
    auto found = converged_.find(text);
    if (found == converged_.end()) {
        ASSIGN_OR_RETURN(auto made, converge(chain, frame_->description, frame_->planes,
                                             settings_->run.plan, *executor_));
        found = converged_.emplace(text, std::move(made)).first;
    }
    // The list of changes belongs to the first variant only.
    found->second.changes.clear();
    converged_chain(chain, &found->second.changes);
    return &found->second;
}

// tde: the difference to the previous frame, from which `before` was made.
Status BenchFrame::measure_step(const ImageF& before, const metrics::Pair& pair,
                                FrameResult& result) const {
    ASSIGN_OR_RETURN(auto pair_before, metrics::pair_of(before, truth_before_->rgb));
    metrics::TemporalError temporal;
    Status status = temporal.add(pair_before);
    if (status.ok()) status = temporal.add(pair);
    if (status.ok()) result.metrics["tde"] = *temporal.last();
    return status;
}

Result<Findings> BenchFrame::measure_input() const {
    ASSIGN_OR_RETURN(auto pair, metrics::pair_of(input_, *truth_));
    ASSIGN_OR_RETURN(auto measured,
                     experiment::measure(pair, &input_, basis_->exposures, settings_->flip, false));
    Findings found;
    found.result.metrics = std::move(measured.values);
    found.maps = std::move(measured.maps);
    if (frame_before_)
        RETURN_IF_ERROR(measure_step(*frame_before_->planes.at(Role::color), pair, found.result));
    return found;
}

Result<Findings> BenchFrame::measure(const Chain& chain, bool split, bool stability) {
    Findings found;
    ASSIGN_OR_RETURN(found.color, filtered(chain, *frame_, &found.result.elisions));
    if (stability) {
        ASSIGN_OR_RETURN(auto measures, temporal_stability(chain, *frame_, found.color,
                                                           settings_->run.plan, *executor_));
        if (measures.flicker) found.result.metrics["flicker"] = *measures.flicker;
        if (measures.grid) found.result.metrics["grid"] = *measures.grid;
    }
    // Filtered but not measured: only other frames have a ground truth.
    if (!truth_ && basis_->truth) return found;
    if (!truth_ || split) {
        ASSIGN_OR_RETURN(found.converged, converge_once(chain));
    }
    ASSIGN_OR_RETURN(auto pair,
                     metrics::pair_of(found.color, truth_ ? truth_->rgb : found.converged->rgb));
    ASSIGN_OR_RETURN(auto measured, experiment::measure(pair, truth_ ? &input_ : nullptr,
                                                        basis_->exposures, settings_->flip, false));
    found.result.metrics.merge(measured.values);
    found.maps = std::move(measured.maps);
    if (frame_before_) {
        ASSIGN_OR_RETURN(auto before, filtered(chain, *frame_before_, nullptr));
        RETURN_IF_ERROR(measure_step(before, pair, found.result));
    }
    if (!split) return found;
    ASSIGN_OR_RETURN(auto reference, run_reference(chain, frame_->description, frame_->planes,
                                                   settings_->run.plan));
    ASSIGN_OR_RETURN(
        found.result.split,
        split_error(number(), found.color, reference.planes.at(Role::color), *found.converged,
                    truth_ ? &*truth_ : nullptr, basis_->exposures, settings_->flip));
    return found;
}

}  // namespace postchain::experiment
