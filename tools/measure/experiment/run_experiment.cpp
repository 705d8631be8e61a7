#include "tools/measure/experiment/run_experiment.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <set>
#include <string>

#include "chain/pass/planner.h"
#include "config/chain_file.h"
#include "tools/measure/experiment/converge.h"
#include "tools/measure/experiment/experiment_input.h"
#include "tools/measure/experiment/outcome.h"
#include "tools/measure/experiment/pixel_classes.h"
#include "tools/measure/experiment/report_folder.h"
#include "tools/measure/experiment/result_store.h"
#include "tools/measure/experiment/statistics.h"
#include "tools/measure/experiment/temporal_stability.h"
#include "tools/measure/experiment/timing.h"
#include "tools/measure/report/images.h"
#include "tools/measure/report/report.h"
#include "tools/metrics/temporal.h"
#include "tools/sequence/run/runner.h"
#include "tools/sequence/source/frame_plan.h"

namespace postchain::experiment {
namespace {

constexpr const char* kTruthName = "truth";  // variant name for results that hold its noise
constexpr int kInput = -1;                   // index of the unfiltered input

bool contains(const std::vector<int>& frames, int frame) {
    return std::ranges::find(frames, frame) != frames.end();
}

// The inputs of all variants in one frame.
struct Frame {
    const sequence::SourceFrame& source;
    int number = 0;
    metrics::RgbImage input;
    std::optional<metrics::RgbImage> truth;
    Image<metrics::PixelClass> classes;  // with a ground truth, or compared with the first result
    // The frame before, for temporal errors: if results are resumed they are made again, not kept
    // in memory.
    std::optional<sequence::SourceFrame> before;
    std::optional<metrics::RgbImage> truth_before;
    Image<metrics::PixelClass> classes_before;
    std::map<std::string, Converged> converged;  // by the converged chain's text
    std::optional<metrics::RgbImage> of_first;   // the first chain's result, if it is the reference
    std::vector<std::map<std::string, ImageF>> maps;  // by variant, if tiles are drawn
};

// Measurements of one variant or of the input in one frame.
struct Findings {
    ImageF color;                          // output of the chain
    std::map<std::string, ImageF> maps;    // empty: filtered, but not measured
    const Converged* converged = nullptr;  // owned by the frame; null if not made
    FrameResult result;
};

// For temporal errors: the error of the last frame that was measured.
struct LastError {
    metrics::TemporalError error;
    std::optional<int> frame;
};

// The question that the chains answer, and their names. Only this tells ab from bench.
struct Asked {
    report::Kind kind = report::Kind::bench;
    std::string title;
    std::vector<std::string> names;  // names of the variants
    std::vector<std::string> files;  // by variant: file name of its results and images
    std::vector<std::string> seeds;
    // Called once the input is usable.
    std::function<Result<io::OutputFiles>(const ExperimentSettings&)> folder;
    bool resumes = false;            // results are stored, and reused
    int split_frames = 0;            // at most, on which the error is split
    std::vector<std::string> tiles;  // metrics by which the second is tested against the first
};

// The reference of the metrics; first: the first chain's result.
enum class Reference { truth, first, converged };

class Run {
  public:
    Run(std::vector<const NamedChain*> variants, Asked asked, const ExperimentSettings& settings,
        Executor& executor, const std::atomic<bool>* stop)
        : variants_(std::move(variants)),
          asked_(std::move(asked)),
          settings_(settings),
          executor_(executor),
          stop_(stop) {}

    Result<report::Report> run(const ProgressCallback& callback) {
        report_.title = asked_.title;
        RETURN_IF_ERROR(start());
        const std::vector<int> open = frames_to_do();
        ProgressMeter progress(report_.frames.size() * variants_.size() + variants_.size(), done_,
                               callback);
        progress_ = &progress;
        RETURN_IF_ERROR(measure_frames(open));
        RETURN_IF_ERROR(time_all());
        RETURN_IF_ERROR(input_.check_unchanged());
        RETURN_IF_ERROR(finish());
        return std::move(report_);
    }

  private:
    // ------------------------------------------------------------------------ conditions
    Status start() {
        ASSIGN_OR_RETURN(input_, open_input(asked_.kind, settings_, report_));
        reference_ = input_.truth                       ? Reference::truth
                     : report_.reference == "converged" ? Reference::converged
                                                        : Reference::first;
        if (reference_ == Reference::first)
            note(concat("without a ground truth the metrics measure the distance of ",
                        variants_[1]->name, " from ", variants_[0]->name,
                        ", not which is more accurate"));
        if (reference_ == Reference::converged)
            note(concat("no model error: ", report_.no_truth,
                        "; the metrics measure each variant's distance from its own converged "
                        "filter"));
        stability_frames_ = spread_frames(report_.frames, settings_.stability_frames);
        split_frames_ = spread_frames(report_.scored_frames, asked_.split_frames);
        for (size_t v = 0; v < variants_.size(); ++v) {
            const NamedChain& one = *variants_[v];
            report::Variant variant;
            variant.name = asked_.names[v];
            variant.sweep = one.sweep;
            variant.chain_text = write_chain(one.chain);
            variant.passes = one.chain.types();
            variant.chain_hash = one.chain.hash();
            report_.variants.push_back(std::move(variant));
            wanted_ = wanted_ | one.chain.required() | one.chain.optional();
        }
        report_.seeds = asked_.seeds;
        results_.resize(variants_.size());
        last_errors_.resize(variants_.size());
        for (const std::string& metric : asked_.tiles)
            tiles_.emplace(metric, TileBootstrap(kBootstrapSeed, kBootstrapReplicates));
        ASSIGN_OR_RETURN(report_.files, asked_.folder(settings_));
        return asked_.resumes ? open_store() : Status();
    }

    Status open_store() {
        report_.constants.emplace_back("converged_seeds", kConvergedSeeds);
        RuleNames rules;
        for (const NamedChain* one : variants_) {
            rules.merge(settings_.run.plan.rules(one->chain));
            if (!(one->chain.camera == variants_[0]->chain.camera) && input_.truth &&
                settings_.truth_cameras.empty())
                note("variants differ in camera but share one ground truth");
        }
        RETURN_IF_ERROR(warn_of_cameras());
        store_.emplace(settings_.folder, conditions_of(report_, settings_, rules), report_.files);
        return store_->prepare();
    }

    // A generated ground truth has the lens and shutter of the scene. Each variant is warned of
    // once.
    Status warn_of_cameras() {
        std::set<const NamedChain*> named;
        for (const auto& [frame, camera] : settings_.truth_cameras) {
            ASSIGN_OR_RETURN(
                const auto header,
                sequence::open_source_frame(settings_.run.source, input_.files.at(frame), frame));
            for (const NamedChain* variant : variants_) {
                if (named.contains(variant)) continue;
                const auto texts = differences_from_truth(variant->chain, header, camera);
                if (texts.empty()) continue;
                named.insert(variant);
                report_.warnings.push_back(
                    concat(variant->name, " filters frame ", frame, " with ", joined(texts, ", "),
                           " of the generated ground truth: its error contains the difference; "
                           "render the sequence with these values, as `postchain scene` takes "
                           "them"));
            }
        }
        return Status();
    }

    bool kept(int frame) const { return contains(report_.page_frames, frame); }

    void note(const std::string& text) {
        auto& notes = report_.notes;
        if (std::ranges::find(notes, text) == notes.end()) notes.push_back(text);
    }

    bool stopped() const { return stop_ && *stop_; }
    Status canceled() const {
        return Status(StatusCode::canceled,
                      store_ ? "stopped; the same command continues" : "stopped");
    }

    // Name in results and images.
    std::string file_name(int v) const {
        return v == kInput ? report::kInputName : asked_.files[size_t(v)];
    }

    // The images of a variant, or of the input with the ground truth, in one frame of the page.
    std::vector<report::StoredImage> images_of(int v, int frame) const {
        using report::ImageKind;
        std::vector<report::StoredImage> images;
        const auto add = [&](ImageKind kind, const std::string& name, const char* map = "") {
            images.push_back(report::stored_image(kind, v, frame, name, map));
        };
        const std::string name = file_name(v);
        add(v == kInput ? ImageKind::input : ImageKind::color, name);
        if (v == kInput && input_.truth) add(ImageKind::truth, kTruthName);
        if (v != kInput || input_.truth)
            for (const char* map : kStoredMaps) add(ImageKind::error, name + "." + map, map);
        // One file for all variants that converge to the same filter.
        if (v != kInput && reference_ == Reference::converged)
            add(ImageKind::converged,
                hex_of(hash_text(converged_chain(variants_[size_t(v)]->chain, nullptr).text())) +
                    ".converged");
        return images;
    }

    Status store_images(int v, const Frame& frame, const Findings& found) {
        if (!kept(frame.number)) return Status();
        for (report::StoredImage& image : images_of(v, frame.number)) {
            using enum report::ImageKind;
            if (image.kind == error && found.maps.empty()) continue;
            const ImageF& pixels = image.kind == input   ? frame.input.rgb
                                   : image.kind == truth ? frame.truth->rgb
                                   : image.kind == color ? found.color
                                   : image.kind == error ? found.maps.at(image.map)
                                                         : found.converged->rgb;
            RETURN_IF_ERROR(report::store_image(report_, std::move(image), pixels));
        }
        return Status();
    }

    // ---------------------------------------------------------------------------- resume
    // Key of a frame's result. The unfiltered input is the result of a chain without passes.
    Result<std::string> key_of(int v, int frame) {
        if (v == kInput)
            return key_of_result(Chain(), frame, concat(" input kept ", kept(frame)), settings_,
                                 input_);
        return key_of_result(
            variants_[size_t(v)]->chain, frame,
            concat(" kept ", kept(frame), " split ", contains(split_frames_, frame), " stability ",
                   contains(stability_frames_, frame)),
            settings_, input_);
    }

    // Loads results of an earlier run and returns the frames with open work.
    std::vector<int> frames_to_do() {
        if (!store_) return report_.frames;
        std::vector<int> open;
        for (int frame : report_.frames) {
            bool whole = take_input(frame);
            for (size_t v = 0; v < variants_.size(); ++v) {
                auto result = stored(file_name(int(v)), int(v), frame);
                if (!result || !take_images(int(v), frame)) {
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
            auto key = key_of(int(v), report_.frames.front());
            if (!key.ok()) continue;
            report_.variants[v].timing = store_->timing(file_name(int(v)), *key);
            if (report_.variants[v].timing) ++done_;
        }
        return open;
    }

    std::optional<FrameResult> stored(const std::string& name, int v, int frame) {
        auto key = key_of(v, frame);
        return key.ok() ? store_->frame(name, frame, *key) : std::nullopt;
    }

    bool take_images(int v, int frame) {
        if (!kept(frame)) return true;
        const auto images = images_of(v, frame);
        return std::ranges::all_of(
            images, [&](const auto& image) { return report::take_stored_image(report_, image); });
    }

    bool take_input(int frame) {
        const bool whole = take_images(kInput, frame);
        if (!whole || !input_.has_truth(frame)) return whole;
        auto result = stored(report::kInputName, kInput, frame);
        auto noise = stored(kTruthName, kInput, frame);
        if (!result || !noise) return false;
        input_results_[frame] = std::move(*result);
        truth_results_[frame] = std::move(*noise);
        return true;
    }

    // Stores the result if the files that it depends on are still the same: those of the frame, of
    // the one before and of their neighbors.
    Status keep(const std::string& name, int v, int frame, const FrameResult& result,
                const std::vector<io::FileStamp>& stamps) {
        RETURN_IF_ERROR(io::check_unchanged(stamps));
        RETURN_IF_ERROR(input_.check_unchanged(frame - 2, frame + 1));
        if (!store_) return Status();
        ASSIGN_OR_RETURN(auto key, key_of(v, frame));
        return store_->keep(name, frame, key, result);
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
        if (stopped()) return canceled();
        return summary->first_failure;
    }

    // `stamps`: of the files the frame was made from.
    Status visit(const sequence::SourceFrame& source, const std::vector<io::FileStamp>& stamps) {
        ASSIGN_OR_RETURN(Frame frame, inputs_of(source));
        frame.maps.resize(tiles_.empty() ? 0 : variants_.size());
        const int number = frame.number;
        for (const auto& text : notes_on_neighbors(source)) note(text);
        RETURN_IF_ERROR(visit_input(frame, stamps));
        for (size_t v = 0; v < variants_.size(); ++v) {
            if (stopped()) return canceled();
            if (results_[v].contains(number)) continue;
            progress_->at(concat("frame ", number, ", ", report_.variants[v].name));
            auto found = measure_variant(frame, v);
            if (found.ok()) {
                // If one result cannot be written, neither can the others. The images are written
                // first, because the result marks them as complete.
                RETURN_IF_ERROR(store_images(int(v), frame, *found));
                RETURN_IF_ERROR(keep(file_name(int(v)), int(v), number, found->result, stamps));
                results_[v][number] = std::move(found->result);
                if (!tiles_.empty()) frame.maps[v] = std::move(found->maps);
            } else {
                std::string& failure = report_.variants[v].failure;
                failure += concat(failure.empty() ? "" : "; ", "frame ", number, ": ",
                                  found.status().message());
            }
            progress_->finished();
        }
        if (frame.truth)
            for (auto& [metric, bootstrap] : tiles_)
                if (frame.maps[0].contains(metric) && frame.maps[1].contains(metric))
                    bootstrap.add(number, tile_sums(frame.maps[0].at(metric),
                                                    frame.maps[1].at(metric), kBootstrapTilePx));
        return Status();
    }

    Result<Frame> inputs_of(const sequence::SourceFrame& source) {
        Frame frame{.source = source, .number = source.description.frame_number};
        ASSIGN_OR_RETURN(frame.input, metrics::rgb_image_of(*source.planes.at(Role::color)));
        frame.classes = classes_of(source);
        if (!input_.has_truth(frame.number)) return frame;
        ASSIGN_OR_RETURN(frame.truth, input_.truth->load(frame.number));
        if (!store_ || !input_.follows(frame.number)) return frame;
        ASSIGN_OR_RETURN(frame.before,
                         read_frame(input_, settings_.run, frame.number - 1, wanted_));
        ASSIGN_OR_RETURN(frame.truth_before, input_.truth->load(frame.number - 1));
        frame.classes_before = classes_of(*frame.before);
        return frame;
    }

    static Image<metrics::PixelClass> classes_of(const sequence::SourceFrame& source) {
        return pixel_classes(source.description, [&](Role role) {
            const auto plane = source.planes.find(role);
            return plane == source.planes.end() ? nullptr : plane->second.get();
        });
    }

    // Scores the unfiltered input, to show whether filtering helped, and measures the noise of the
    // ground truth.
    Status visit_input(const Frame& frame, const std::vector<io::FileStamp>& stamps) {
        if (input_results_.contains(frame.number)) return Status();
        Findings found;
        if (!frame.truth) return store_images(kInput, frame, found);
        ASSIGN_OR_RETURN(auto pair, metrics::pair_of(frame.input, *frame.truth));
        RETURN_IF_ERROR(score(frame, pair, last_error_of_input_, found, [&]() -> Result<ImageF> {
            return *frame.before->planes.at(Role::color);
        }));
        RETURN_IF_ERROR(store_images(kInput, frame, found));
        FrameResult noise;
        ASSIGN_OR_RETURN(noise.metrics, noise_of_truth(*frame.truth, frame.input));
        noise.slice = slice_of(*frame.truth);
        RETURN_IF_ERROR(keep(report::kInputName, kInput, frame.number, found.result, stamps));
        RETURN_IF_ERROR(keep(kTruthName, kInput, frame.number, noise, stamps));
        input_results_[frame.number] = std::move(found.result);
        truth_results_[frame.number] = std::move(noise);
        return Status();
    }

    Result<Findings> measure_variant(Frame& frame, size_t v) {
        const Chain& chain = variants_[v]->chain;
        const PlanOptions& options = settings_.run.plan;
        Findings found;
        ASSIGN_OR_RETURN(found.color, filtered(chain, frame.source, &found.result.elisions));
        if (contains(stability_frames_, frame.number)) {
            ASSIGN_OR_RETURN(auto stability, temporal_stability(chain, frame.source, found.color,
                                                                options, executor_));
            if (stability.flicker) found.result.metrics["flicker"] = *stability.flicker;
            if (stability.grid) found.result.metrics["grid"] = *stability.grid;
        }
        // Filtered but not measured: only other frames have a ground truth.
        if (!frame.truth && input_.truth) return found;
        const bool split = contains(split_frames_, frame.number);
        if (split || reference_ == Reference::converged) {
            ASSIGN_OR_RETURN(found.converged, converge_once(frame, chain));
        }
        if (reference_ == Reference::first && v == 0) {
            ASSIGN_OR_RETURN(frame.of_first, metrics::rgb_image_of(found.color));
            return found;
        }
        if (reference_ == Reference::first && !frame.of_first) return found;  // the first failed
        const ImageF& reference = reference_ == Reference::truth   ? frame.truth->rgb
                                  : reference_ == Reference::first ? frame.of_first->rgb
                                                                   : found.converged->rgb;
        ASSIGN_OR_RETURN(auto pair, metrics::pair_of(found.color, reference));
        RETURN_IF_ERROR(score(frame, pair, last_errors_[v], found,
                              [&] { return filtered(chain, *frame.before, nullptr); }));
        if (frame.truth) found.result.slice = slice_of(pair.test);
        if (!split) return found;
        ASSIGN_OR_RETURN(auto exact, run_reference(chain, frame.source.description,
                                                   frame.source.planes, options));
        ASSIGN_OR_RETURN(
            found.result.split,
            split_error(frame.number, found.color, exact.planes.at(Role::color), *found.converged,
                        frame.truth ? &*frame.truth : nullptr, input_.exposures, settings_.flip));
        if (!frame.truth)
            found.result.split->notes.push_back("no model error: " + report_.no_truth);
        return found;
    }

    // Pixels of report_.slice.
    std::vector<float> slice_of(const metrics::RgbImage& image) const {
        if (!report_.slice) return {};
        const auto& [row, left, width] = *report_.slice;
        const float* first = image.rgb.pixel(left, row);
        return {first, first + 3 * width};
    }

    // Slices over time, with a row for each scored frame; NaN where a frame failed.
    Status store_slices() {
        if (!report_.slice) return Status();
        const std::vector<int>& frames = report_.scored_frames;
        const auto store = [&](int v, const std::string& name,
                               const std::map<int, FrameResult>& results) {
            if (results.empty()) return Status();
            ImageF image(report_.slice->width, int(frames.size()), 3, std::nanf(""));
            for (size_t i = 0; i < frames.size(); ++i)
                if (const auto found = results.find(frames[i]);
                    found != results.end() && found->second.slice.size() == size_t(3 * image.width))
                    std::ranges::copy(found->second.slice, image.pixel(0, int(i)));
            return report::store_image(
                report_,
                report::stored_image(report::ImageKind::slice, v, frames[0], name + ".slice"),
                image);
        };
        RETURN_IF_ERROR(store(kInput, kTruthName, truth_results_));
        for (size_t v = 0; v < variants_.size(); ++v)
            RETURN_IF_ERROR(store(int(v), file_name(int(v)), results_[v]));
        return Status();
    }

    Result<ImageF> filtered(const Chain& chain, const sequence::SourceFrame& frame,
                            std::vector<Elision>* elisions) {
        ASSIGN_OR_RETURN(auto plan, sequence::plan_source_frame(chain, frame, settings_.run.plan));
        ASSIGN_OR_RETURN(auto result, executor_.filter(plan, frame.planes));
        if (elisions)
            for (const Elision& elision : plan.elisions)
                if (const auto found = found_in(elision, plan, executor_.work_done()))
                    elisions->push_back(*found);
        return std::move(result.at(Role::color));
    }

    // Variants that differ only in converging rows share one converged image.
    Result<const Converged*> converge_once(Frame& frame, const Chain& chain) {
        const std::string text = converged_chain(chain, nullptr).text();
        auto found = frame.converged.find(text);
        if (found == frame.converged.end()) {
            ASSIGN_OR_RETURN(auto made,
                             converge(chain, frame.source.description, frame.source.planes,
                                      settings_.run.plan, executor_));
            found = frame.converged.emplace(text, std::move(made)).first;
        }
        // The list of changes belongs to the first variant only.
        found->second.changes.clear();
        converged_chain(chain, &found->second.changes);
        return &found->second;
    }

    // Metrics and maps of an image. Temporal errors are of the step from the frame before, whose
    // error is in `last`; if results are resumed `before` makes its image again: an earlier run may
    // have measured it.
    template <class Before>
    Status score(const Frame& frame, const metrics::Pair& pair, LastError& last, Findings& found,
                 const Before& before) {
        ASSIGN_OR_RETURN(auto measured, measure(pair, frame.truth ? &frame.input : nullptr,
                                                input_.exposures, settings_.flip, !tiles_.empty()));
        found.result.metrics.merge(measured.values);
        found.maps = std::move(measured.maps);
        if (store_ && !frame.before) return Status();
        if (store_ || last.frame != frame.number - 1) last.error = {};
        if (frame.before) {
            ASSIGN_OR_RETURN(const ImageF image, before());
            ASSIGN_OR_RETURN(auto pair_before, metrics::pair_of(image, frame.truth_before->rgb));
            RETURN_IF_ERROR(last.error.add(pair_before, frame.classes_before));
        }
        RETURN_IF_ERROR(last.error.add(pair, frame.classes));
        for (const auto& [name, value] : last.error.last())
            if (value) found.result.metrics[name] = *value;
        last.frame = frame.number;
        if (store_) last = {};  // an image for each variant
        return Status();
    }

    // ----------------------------------------------------------------------------- times
    Status time_all() {
        const int frame = report_.frames.front();
        std::optional<sequence::SourceFrame> source;
        for (size_t v = 0; v < variants_.size(); ++v) {
            if (stopped()) return canceled();
            report::Variant& variant = report_.variants[v];
            if (!variant.timing && !variant.failure.empty()) {
                progress_->finished();
            } else if (!variant.timing) {
                progress_->at("timing " + variant.name);
                if (!source) {
                    ASSIGN_OR_RETURN(source, read_frame(input_, settings_.run, frame, wanted_));
                }
                RETURN_IF_ERROR(time_one(v, *source));
                RETURN_IF_ERROR(input_.check_unchanged());
                if (store_ && variant.timing) {
                    ASSIGN_OR_RETURN(auto key, key_of(int(v), frame));
                    RETURN_IF_ERROR(store_->keep(file_name(int(v)), key, *variant.timing));
                }
                progress_->finished();
            }
        }
        const std::string doubt = report::doubt_about_times(report_);
        if (!doubt.empty()) report_.notes.push_back(doubt);
        return Status();
    }

    // Nothing else in this process runs meanwhile.
    Status time_one(size_t v, const sequence::SourceFrame& source) {
        report::Variant& variant = report_.variants[v];
        auto plan = sequence::plan_source_frame(variants_[v]->chain, source, settings_.run.plan);
        auto timing = plan.ok() ? time_plan(executor_, *plan, source.planes, settings_.repeats)
                                : Result<report::Timing>(plan.status());
        if (timing.ok()) {
            variant.timing = std::move(*timing);
            report::Timing& found = *variant.timing;
            if (found.total.n < report::kTrustedRepeats) {
                found.trustworthy = false;
                found.why_not = concat("fewer than ", report::kTrustedRepeats, " repetitions");
            }
        } else if (stopped())
            return timing.status();
        else
            variant.failure = "timing: " + timing.status().message();
        return Status();
    }

    // --------------------------------------------------------------------------- results
    Status finish() {
        RETURN_IF_ERROR(store_slices());
        std::vector<std::pair<WorstTile, std::string>> worst;
        for (size_t v = 0; v < variants_.size(); ++v) {
            gather(v);
            for (int frame : report_.page_frames) {
                const report::StoredImage* map =
                    report_.find(report::ImageKind::error, int(v), frame, "hdr_flip");
                if (!map) continue;
                ASSIGN_OR_RETURN(auto pixels, report::load_image(report_, *map));
                worst.emplace_back(worst_tile(pixels, frame, kCropPx), report_.variants[v].name);
            }
        }
        for (size_t i = 0; i < report_.frames.size(); ++i) {
            const int frame = report_.frames[i];
            if (!input_results_.contains(frame)) continue;
            set_values(report_.input_metrics, i, input_results_.at(frame));
            set_values(report_.truth_noise, i, truth_results_.at(frame));
        }
        find_means(report_.input_metrics);
        find_means(report_.truth_noise);
        report_.crops = crops_of(std::move(worst));
        if (tiles_.empty())
            mark_pareto(report_, kDecidingMetric);
        else
            report_.comparison = compare_variants(report_, tiles_);
        state_outcome(report_);
        return Status();
    }

    // Series, elisions and mean split of a variant from its frames.
    void gather(size_t v) {
        report::Variant& variant = report_.variants[v];
        std::vector<report::ErrorSplit> splits;
        for (size_t i = 0; i < report_.frames.size(); ++i) {
            const int frame = report_.frames[i];
            const auto found = results_[v].find(frame);
            if (found == results_[v].end()) continue;
            const FrameResult& result = found->second;
            // A comparison also lists columns without a value.
            for (const auto& column : report_.metrics)
                if (!tiles_.empty() && (result.metrics.contains(kDecidingMetric) ||
                                        ((column.name == "flicker" || column.name == "grid") &&
                                         contains(stability_frames_, frame))))
                    set_value(variant.metrics, column.name, i, report_.frames.size(), {});
            set_values(variant.metrics, i, result);
            for (const Elision& elision : result.elisions)
                variant.elisions.emplace_back(frame, elision);
            if (result.split) splits.push_back(*result.split);
        }
        find_means(variant.metrics);
        if (!splits.empty()) variant.split = mean_split(splits);
    }

    void set_values(report::Metrics& metrics, size_t index, const FrameResult& result) const {
        for (const auto& [name, value] : result.metrics)
            set_value(metrics, name, index, report_.frames.size(), value);
    }

    const std::vector<const NamedChain*> variants_;
    const Asked asked_;
    const ExperimentSettings& settings_;
    Executor& executor_;
    const std::atomic<bool>* stop_;
    ProgressMeter* progress_ = nullptr;
    report::Report report_;
    ExperimentInput input_;
    Reference reference_ = Reference::truth;
    std::vector<int> split_frames_, stability_frames_;
    RoleSet wanted_;
    std::vector<std::map<int, FrameResult>> results_;           // by variant, then by frame
    std::map<int, FrameResult> input_results_, truth_results_;  // by frame; the second: noise
    std::vector<LastError> last_errors_;                        // by variant
    LastError last_error_of_input_;
    std::optional<ResultStore> store_;            // if results are resumed
    size_t done_ = 0;                             // units reused from an earlier run
    std::map<std::string, TileBootstrap> tiles_;  // by metric
};

Result<report::Report> run(const std::vector<const NamedChain*>& variants, Asked asked,
                           ExperimentSettings settings, Executor& executor,
                           const ProgressCallback& progress, const std::atomic<bool>* stop) {
    std::vector<const Chain*> chains;
    for (const NamedChain* one : variants) chains.push_back(&one->chain);
    settings.run = sequence::settings_for(settings.run, chains);
    settings.run.plan.device = executor.device_class();
    const StopScope within_a_frame(executor, stop);
    return Run(variants, std::move(asked), settings, executor, stop).run(progress);
}

}  // namespace

Result<report::Report> run_ab(const NamedChain& a, const NamedChain& b,
                              const ExperimentSettings& settings, Executor& executor,
                              const ProgressCallback& progress, const std::atomic<bool>* stop) {
    const bool namesakes = a.name == b.name;
    Asked asked{.kind = report::Kind::ab,
                .title = a.name + " against " + b.name,
                .names = {a.name + (namesakes ? " (A)" : ""), b.name + (namesakes ? " (B)" : "")},
                .files = {"a", "b"},
                .seeds = {},
                .folder = prepare_folder,
                .tiles = {"flip", "hdr_flip", "relmse", "smape", "mse"}};
    for (const NamedChain* one : {&a, &b})
        for (const auto& seed : seeds_of(one->chain))
            asked.seeds.push_back(one->name + ": " + seed);
    return run({&a, &b}, std::move(asked), settings, executor, progress, stop);
}

Result<report::Report> run_bench(const std::vector<NamedChain>& variants,
                                 const BenchSettings& settings, const io::OutputFiles& files,
                                 Executor& executor, const ProgressCallback& progress,
                                 const std::atomic<bool>* stop) {
    Asked asked{.kind = report::Kind::bench,
                .title = settings.chain_name + ": error against run time",
                .names = {},
                .files = {},
                .seeds = seeds_of(variants[0].chain),
                .folder = [&](const ExperimentSettings&) { return Result<io::OutputFiles>(files); },
                .resumes = true,
                .split_frames = settings.split_frames,
                .tiles = {}};
    std::vector<const NamedChain*> all;
    for (const NamedChain& variant : variants) {
        all.push_back(&variant);
        asked.names.push_back(variant.name);
        asked.files.push_back(hex_of(variant.chain.hash()));
    }
    return run(all, std::move(asked), settings, executor, progress, stop);
}

}  // namespace postchain::experiment
