#include "tools/measure/experiment/bench.h"

#include <algorithm>
#include <set>
#include <string>

#include "tools/measure/experiment/bench_frame.h"
#include "tools/measure/experiment/bench_key.h"
#include "tools/measure/experiment/choose.h"
#include "tools/measure/experiment/outcome.h"
#include "tools/measure/experiment/temporal_stability.h"
#include "tools/measure/experiment/timing.h"
#include "tools/measure/report/images.h"
#include "tools/measure/report/lists.h"
#include "tools/sequence/run/runner.h"
#include "tools/sequence/source/frame_plan.h"

namespace postchain::experiment {
namespace {

constexpr const char* kParetoMetric = "hdr_flip";
constexpr const char* kTruthName = "truth";  // variant name for results that hold its noise

class BenchRun {
  public:
    BenchRun(const std::vector<BenchVariant>& variants, const BenchSettings& settings,
             const io::OutputFiles& files, Executor& executor, const std::atomic<bool>* stop)
        : variants_(variants),
          settings_(settings),
          files_(files),
          executor_(executor),
          stop_(stop) {}

    Result<report::Report> run(const ProgressCallback& callback) {
        RETURN_IF_ERROR(start());
        const std::vector<int> open = frames_to_do();
        ProgressMeter progress(report_.frames.size() * variants_.size() + variants_.size(), done_,
                               callback);
        progress_ = &progress;
        RETURN_IF_ERROR(measure_frames(open));
        RETURN_IF_ERROR(time_all());
        RETURN_IF_ERROR(finish());
        return std::move(report_);
    }

  private:
    // ------------------------------------------------------------------------ conditions
    Status start() {
        report_.title = settings_.chain_name + ": error against run time";
        ASSIGN_OR_RETURN(basis_, open_basis(report::Kind::bench, settings_, report_));
        if (!basis_.truth)
            report_.notes.push_back(
                "no model error: " + report_.no_truth +
                "; the metrics measure each variant's distance from its own converged filter");
        split_frames_ = spread_frames(report_.scored_frames, settings_.split_frames);
        stability_frames_ = spread_frames(report_.frames, settings_.stability_frames);
        report_.constants.emplace_back("converged_seeds", kConvergedSeeds);
        for (const BenchVariant& one : variants_) {
            report::Variant variant;
            variant.name = one.name;
            variant.sweep = one.sweep;
            variant.chain_text = write_chain(one.chain);
            variant.passes = one.chain.types();
            variant.chain_hash = one.chain.hash();
            report_.variants.push_back(std::move(variant));
            wanted_ = wanted_ | one.chain.required() | one.chain.optional();
            if (!(one.chain.camera == variants_[0].chain.camera) && basis_.truth &&
                settings_.truth_cameras.empty())
                note("variants differ in camera but share one ground truth");
        }
        RETURN_IF_ERROR(warn_of_cameras());
        for (const auto& seed : seeds_of(variants_[0].chain)) report_.seeds.push_back(seed);
        report_.files = files_;
        store_.emplace(settings_.folder, conditions_of(report_, settings_, variants_), files_);
        return store_->prepare();
    }

    // A generated ground truth has the lens and shutter of the scene. Each variant is warned of
    // once.
    Status warn_of_cameras() {
        std::set<const BenchVariant*> named;
        for (const auto& [frame, camera] : settings_.truth_cameras) {
            ASSIGN_OR_RETURN(
                const auto header,
                sequence::open_source_frame(settings_.run.source, basis_.files.at(frame), frame));
            for (const BenchVariant& variant : variants_) {
                if (named.contains(&variant)) continue;
                const auto texts = differences_from_truth(variant.chain, header, camera);
                if (texts.empty()) continue;
                named.insert(&variant);
                report_.warnings.push_back(
                    concat(variant.name, " filters frame ", frame, " with ", joined(texts, ", "),
                           " of the generated ground truth: its error contains the difference; "
                           "render the sequence with these values, as `postchain scene` takes "
                           "them"));
            }
        }
        return Status();
    }

    // Key of a frame's result.
    Result<std::string> work_of(size_t v, int frame) {
        return work_on(variants_[v].chain, frame,
                       concat(" kept ", kept(frame), " split ", split(frame), " stability ",
                              contains(stability_frames_, frame)),
                       settings_, basis_);
    }
    // Key of the unfiltered input, the result of a chain without passes.
    Result<std::string> work_of_input(int frame) {
        return work_on(Chain(), frame, concat(" input kept ", kept(frame)), settings_, basis_);
    }

    std::string name_of_variant(size_t v) const { return hex_of(report_.variants[v].chain_hash); }
    static bool contains(const std::vector<int>& frames, int frame) {
        return std::find(frames.begin(), frames.end(), frame) != frames.end();
    }
    bool kept(int frame) const { return contains(report_.page_frames, frame); }
    bool split(int frame) const { return contains(split_frames_, frame); }

    // ---------------------------------------------------------------------------- resume
    // Loads results of an earlier run and returns the frames with open work.
    std::vector<int> frames_to_do() {
        results_.resize(variants_.size());
        std::vector<int> open;
        for (int frame : report_.frames) {
            const bool pictures = !kept(frame) || take_common(frame);
            bool whole = take_input_score(frame) && pictures;
            for (size_t v = 0; v < variants_.size(); ++v) {
                auto work = work_of(v, frame);
                auto result =
                    work.ok() ? store_->frame(name_of_variant(v), frame, *work) : std::nullopt;
                if (!result || (kept(frame) && !take_images(v, frame))) {
                    whole = false;
                    continue;
                }
                results_[v][frame] = std::move(*result);
                report_.variants[v].resumed = true;
                ++done_;
            }
            if (!whole) open.push_back(frame);
        }
        for (size_t v = 0; v < variants_.size(); ++v) {
            auto work = work_of(v, report_.frames.front());
            if (!work.ok()) continue;
            report_.variants[v].timing = store_->timing(name_of_variant(v), *work);
            if (report_.variants[v].timing) ++done_;
        }
        return open;
    }

    report::StoredImage input_error_entry(int frame, const char* map) const {
        return report::stored_image(report::ImageKind::error, -1, frame, concat("input.", map),
                                    map);
    }
    report::StoredImage error_entry(size_t v, int frame, const char* map) const {
        return report::stored_image(report::ImageKind::error, int(v), frame,
                                    concat(name_of_variant(v), ".", map), map);
    }
    // One file for all variants that converge to the same filter.
    report::StoredImage converged_entry(size_t v, int frame) const {
        const std::string text = converged_chain(variants_[v].chain, nullptr).text();
        return report::stored_image(report::ImageKind::converged, int(v), frame,
                                    hex_of(hash_text(text)) + ".converged");
    }
    bool take_common(int frame) {
        return report::take_stored_image(
                   report_, report::stored_image(report::ImageKind::input, -1, frame, "input")) &&
               (!basis_.truth ||
                report::take_stored_image(
                    report_, report::stored_image(report::ImageKind::truth, -1, frame, "truth")));
    }
    bool take_input_score(int frame) {
        if (!basis_.has_truth(frame)) return true;
        auto work = work_of_input(frame);
        auto result = work.ok() ? store_->frame(report::kInputName, frame, *work) : std::nullopt;
        auto noise = work.ok() ? store_->frame(kTruthName, frame, *work) : std::nullopt;
        bool whole = result.has_value() && noise.has_value();
        for (const char* map : kStoredMaps)
            whole = whole && (!kept(frame) ||
                              report::take_stored_image(report_, input_error_entry(frame, map)));
        if (!whole) return false;
        input_results_[frame] = std::move(*result);
        truth_results_[frame] = std::move(*noise);
        return true;
    }
    bool take_images(size_t v, int frame) {
        bool whole = report::take_stored_image(
            report_,
            report::stored_image(report::ImageKind::color, int(v), frame, name_of_variant(v)));
        for (const char* map : kStoredMaps)
            whole = whole && report::take_stored_image(report_, error_entry(v, frame, map));
        return whole &&
               (basis_.truth || report::take_stored_image(report_, converged_entry(v, frame)));
    }

    // ---------------------------------------------------------------------------- frames
    Status measure_frames(const std::vector<int>& open) {
        if (open.empty()) return Status();
        sequence::RunSettings run = settings_.run;
        run.frames = io::FrameRange{open};
        auto summary = sequence::visit_sequence(
            run, wanted_,
            [&](sequence::SourceFrame& frame, sequence::FrameReport& report) {
                return visit(frame, report.stamps);
            },
            [&](const sequence::FrameReport& frame, const sequence::RunProgress&) {
                for (const auto& warning : frame.warnings) note(warning);
            },
            stop_);
        if (!summary.ok()) return summary.status();
        if (stopped()) return Status(StatusCode::canceled, "stopped; the same command continues");
        return summary->first_failure;
    }

    void note(const std::string& text) {
        auto& notes = report_.notes;
        if (std::find(notes.begin(), notes.end(), text) == notes.end()) notes.push_back(text);
    }

    bool stopped() const { return stop_ && *stop_; }

    // `stamps`: of the files the frame was made from.
    Status visit(const sequence::SourceFrame& source, const std::vector<io::FileStamp>& stamps) {
        ASSIGN_OR_RETURN(auto frame,
                         BenchFrame::open(settings_, basis_, executor_, wanted_, source,
                                          basis_.follows(source.description.frame_number)));
        const int number = frame.number();
        for (const auto& text : notes_on_neighbors(source)) note(text);
        if (kept(number)) {
            Status status = report::store_image(
                report_, report::stored_image(report::ImageKind::input, -1, number, "input"),
                frame.input().rgb);
            if (status.ok() && frame.truth())
                status = report::store_image(
                    report_, report::stored_image(report::ImageKind::truth, -1, number, "truth"),
                    frame.truth()->rgb);
            if (!status.ok()) return status;
        }
        if (frame.truth() && !input_results_.count(number))
            RETURN_IF_ERROR(score_input(frame, stamps));
        for (size_t v = 0; v < variants_.size(); ++v) {
            if (stopped()) return Status(StatusCode::canceled, "stopped");
            if (results_[v].count(number)) continue;
            progress_->at(concat("frame ", number, ", ", variants_[v].name));
            auto found = frame.measure(variants_[v].chain, split(number),
                                       contains(stability_frames_, number));
            if (found.ok()) {
                // If one result cannot be written, neither can the others.
                RETURN_IF_ERROR(keep(v, number, std::move(*found), stamps));
            } else {
                std::string& failure = report_.variants[v].failure;
                failure += concat(failure.empty() ? "" : "; ", "frame ", number, ": ",
                                  found.status().message());
            }
            progress_->finished();
        }
        return Status();
    }

    Status score_input(const BenchFrame& frame, const std::vector<io::FileStamp>& stamps) {
        const int number = frame.number();
        ASSIGN_OR_RETURN(auto found, frame.measure_input());
        for (const char* map : kStoredMaps)
            if (kept(number))
                RETURN_IF_ERROR(report::store_image(report_, input_error_entry(number, map),
                                                    found.maps.at(map)));
        ASSIGN_OR_RETURN(auto noise, noise_of_truth(*frame.truth(), frame.input()));
        FrameResult of_truth;
        of_truth.metrics = std::move(noise);
        ASSIGN_OR_RETURN(auto work, work_of_input(number));
        Status status = keep_result(report::kInputName, number, work, found.result, stamps);
        if (status.ok()) status = keep_result(kTruthName, number, work, of_truth, stamps);
        if (!status.ok()) return status;
        input_results_[number] = std::move(found.result);
        truth_results_[number] = std::move(of_truth);
        return Status();
    }

    // Stores the result and notes the files it depends on.
    Status keep_result(const std::string& name, int number, const std::string& work,
                       const FrameResult& result, const std::vector<io::FileStamp>& stamps) {
        for (const auto& files : {stamps, basis_.stamps})
            RETURN_IF_ERROR(io::check_unchanged(files));
        return store_->keep(name, number, work, result);
    }

    // Writes the images first, because the result marks them as complete.
    Status keep(size_t v, int number, Findings found, const std::vector<io::FileStamp>& stamps) {
        if (kept(number)) {
            Status status = report::store_image(
                report_,
                report::stored_image(report::ImageKind::color, int(v), number, name_of_variant(v)),
                found.color);
            for (const char* map : kStoredMaps)
                if (status.ok())
                    status = report::store_image(report_, error_entry(v, number, map),
                                                 found.maps.at(map));
            if (status.ok() && !basis_.truth)
                status =
                    report::store_image(report_, converged_entry(v, number), found.converged->rgb);
            if (!status.ok()) return status;
        }
        FrameResult& result = found.result;
        if (result.split && !basis_.truth)
            result.split->notes.push_back("no model error: " + report_.no_truth);
        ASSIGN_OR_RETURN(auto work, work_of(v, number));
        RETURN_IF_ERROR(keep_result(name_of_variant(v), number, work, result, stamps));
        results_[v][number] = std::move(result);
        return Status();
    }

    // ----------------------------------------------------------------------------- times
    Status time_all() {
        const int frame = report_.frames.front();
        std::optional<sequence::SourceFrame> source;
        for (size_t v = 0; v < variants_.size(); ++v) {
            if (stopped())
                return Status(StatusCode::canceled, "stopped; the same command continues");
            report::Variant& variant = report_.variants[v];
            if (!variant.timing && !variant.failure.empty()) {
                progress_->finished();
            } else if (!variant.timing) {
                progress_->at("timing " + variant.name);
                ASSIGN_OR_RETURN(auto work, work_of(v, frame));
                RETURN_IF_ERROR(time_one(v, frame, source));
                RETURN_IF_ERROR(io::check_unchanged(basis_.stamps));
                if (variant.timing)
                    RETURN_IF_ERROR(store_->keep(name_of_variant(v), work, *variant.timing));
                progress_->finished();
            }
        }
        const std::string doubt = report::doubt_about_times(report_);
        if (!doubt.empty()) report_.notes.push_back(doubt);
        return Status();
    }

    Status time_one(size_t v, int frame, std::optional<sequence::SourceFrame>& source) {
        if (!source) {
            ASSIGN_OR_RETURN(source, read_frame(basis_, settings_.run, frame, wanted_));
        }
        report::Variant& variant = report_.variants[v];
        auto plan = sequence::plan_source_frame(variants_[v].chain, *source, settings_.run.plan);
        auto timing = plan.ok() ? time_plan(executor_, *plan, source->planes, settings_.repeats)
                                : Result<report::Timing>(plan.status());
        if (timing.ok())
            variant.timing = std::move(*timing);
        else if (stopped())
            return timing.status();
        else
            variant.failure = "timing: " + timing.status().message();
        return Status();
    }

    // --------------------------------------------------------------------------- results
    Status finish() {
        std::vector<std::pair<WorstTile, std::string>> worst;
        const size_t count = report_.frames.size();
        for (size_t v = 0; v < variants_.size(); ++v) {
            report::Variant& variant = report_.variants[v];
            std::vector<report::ErrorSplit> splits;
            for (size_t i = 0; i < count; ++i) {
                const auto result = results_[v].find(report_.frames[i]);
                if (result == results_[v].end()) continue;
                for (const auto& [name, value] : result->second.metrics)
                    set_value(variant.metrics, name, i, count, value);
                for (const Elision& elision : result->second.elisions)
                    variant.elisions.emplace_back(report_.frames[i], elision);
                if (result->second.split) splits.push_back(*result->second.split);
            }
            find_means(variant.metrics);
            if (!splits.empty()) variant.split = mean_split(splits);
            for (int frame : report_.page_frames) {
                const report::StoredImage* map =
                    report_.find(report::ImageKind::error, int(v), frame, "hdr_flip");
                if (!map) continue;
                ASSIGN_OR_RETURN(auto pixels, report::load_image(report_, *map));
                worst.emplace_back(worst_tile(pixels, frame, kCropPx), variant.name);
            }
        }
        for (size_t i = 0; i < count; ++i) {
            const int frame = report_.frames[i];
            if (!input_results_.contains(frame)) continue;
            for (const auto& [name, value] : input_results_.at(frame).metrics)
                set_value(report_.input_metrics, name, i, count, value);
            for (const auto& [name, value] : truth_results_.at(frame).metrics)
                set_value(report_.truth_noise, name, i, count, value);
        }
        find_means(report_.input_metrics);
        find_means(report_.truth_noise);
        report_.crops = crops_of(std::move(worst));
        mark_pareto(report_, kParetoMetric);
        state_outcome(report_);
        return Status();
    }

    const std::vector<BenchVariant>& variants_;
    const BenchSettings& settings_;
    const io::OutputFiles& files_;
    Executor& executor_;
    const std::atomic<bool>* stop_;
    ProgressMeter* progress_ = nullptr;
    report::Report report_;
    Basis basis_;
    std::optional<BenchStore> store_;
    std::vector<int> split_frames_, stability_frames_;
    RoleSet wanted_;
    std::vector<std::map<int, FrameResult>> results_;  // by variant
    std::map<int, FrameResult> input_results_,
        truth_results_;  // by frame; the latter holds the noise
    size_t done_ = 0;    // units reused from an earlier run
};

}  // namespace

Result<report::Report> run_bench(const std::vector<BenchVariant>& variants,
                                 const BenchSettings& settings, const io::OutputFiles& files,
                                 Executor& executor, const ProgressCallback& progress,
                                 const std::atomic<bool>* stop) {
    std::vector<const Chain*> chains;
    for (const BenchVariant& variant : variants) chains.push_back(&variant.chain);
    BenchSettings with_mattes = settings;
    with_mattes.run = sequence::settings_for(settings.run, chains);
    const StopScope within_a_frame(executor, stop);
    return BenchRun(variants, with_mattes, files, executor, stop).run(progress);
}

}  // namespace postchain::experiment
