#include "tools/report/bench.h"

#include <algorithm>
#include <filesystem>
#include <thread>

#include "chain/planner.h"
#include "tools/report/bench_store.h"
#include "tools/report/converge.h"
#include "tools/report/images.h"
#include "tools/report/statistics.h"
#include "tools/report/timing.h"
#include "tools/report/truth.h"

namespace postchain::report {
namespace {

constexpr const char* kParetoMetric = "hdr_flip";
constexpr size_t kCrops = 6;

class BenchRun {
  public:
    BenchRun(const std::vector<BenchVariant>& variants, const BenchSettings& settings,
             Executor& executor, const std::atomic<bool>* stop)
        : variants_(variants), settings_(settings), executor_(executor), stop_(stop) {}

    Result<Report> run(const ProgressCallback& callback) {
        if (Status status = start(); !status.ok()) return status;
        const std::vector<int> open = frames_to_do();
        ProgressMeter progress(report_.frames.size() * variants_.size() + variants_.size(), done_,
                               callback);
        progress_ = &progress;
        if (Status status = measure_frames(open); !status.ok()) return status;
        if (Status status = time_all(); !status.ok()) return status;
        if (Status status = finish(); !status.ok()) return status;
        return std::move(report_);
    }

  private:
    // ------------------------------------------------------------------------ conditions
    Status start() {
        report_.kind = Kind::bench;
        report_.title = "Error against run time";
        state_conditions(settings_, report_);
        const auto mapper = settings_.flip.tone_mapper;
        auto survey = survey_input(settings_.run, mapper, settings_.truth.empty());
        if (!survey.ok()) return survey.status();
        report_.frames = survey->frames;
        report_.width = survey->width;
        report_.height = survey->height;
        exposures_ = survey->exposures;
        if (!settings_.truth.empty()) {
            auto truth = Truth::open(settings_.truth, report_.frames);
            if (!truth.ok()) return truth.status();
            if (Status status = truth->survey(settings_.run, mapper); !status.ok()) return status;
            exposures_ = truth->exposures();
            truth_ = std::move(*truth);
            report_.truth = settings_.truth_is.empty() ? settings_.truth : settings_.truth_is;
            report_.reference = "truth";
        } else {
            report_.no_truth = settings_.no_truth.empty() ? "none was given" : settings_.no_truth;
            report_.reference = "converged";
            report_.notes.push_back(
                "model error is left out: " + report_.no_truth +
                "; the metrics say how far each variant is from its own filter converged");
        }
        report_.page_frames = spread_frames(report_.frames, settings_.page_frames);
        split_frames_ = spread_frames(report_.frames, settings_.split_frames);
        report_.metrics = metric_columns(Kind::bench, truth_.has_value());
        report_.constants = metrics::metric_constants();
        report_.constants.emplace_back("pixels_per_degree", settings_.flip.pixels_per_degree);
        report_.constants.emplace_back("converged_seeds", kConvergedSeeds);
        report_.exposure_start = exposures_.start;
        report_.exposure_stop = exposures_.stop;
        report_.exposures = exposures_.exposures();
        report_.tone_mapper = metrics::name_of(mapper);
        for (const BenchVariant& one : variants_) {
            Variant variant;
            variant.name = one.name;
            variant.sweep = one.sweep;
            variant.chain_text = write_chain(one.chain);
            variant.chain_hash = one.chain.hash();
            report_.variants.push_back(std::move(variant));
            wanted_ = wanted_ | one.chain.required() | one.chain.optional();
            if (!(one.chain.camera == variants_[0].chain.camera) && truth_ && report_.notes.empty())
                report_.notes.push_back(
                    "variants differ in their camera; the truth is the same for all of them");
        }
        for (const auto& seed : seeds_of(variants_[0].chain)) report_.seeds.push_back(seed);
        auto list = io::find_frames(settings_.run.input, settings_.run.frames);
        if (!list.ok()) return list.status();
        files_ = std::move(list->files);
        store_.emplace(settings_.folder, conditions());
        return store_->prepare();
    }

    // Everything a result depends on besides chain and input files.
    std::string conditions() const {
        std::string text =
            concat("results 1\n", report_.version, "\n", report_.renderer, "\n", report_.threads,
                   "\n", report_.precision, "\n", settings_.run.plan.elide, "\n",
                   report_.tone_mapper, " ", settings_.flip.pixels_per_degree, " ",
                   report_.exposure_start, " ", report_.exposure_stop, "\n", kConvergedSeeds, " ",
                   settings_.repeats, "\n", report_.reference, "\n");
        for (const auto& rule : settings_.run.plan.rules_off) text += rule + "\n";
        return text;
    }

    // Chain, input file and truth file of one frame.
    Result<std::string> work_of(size_t v, int frame) {
        auto header = offline::open_source_frame(settings_.run.source, files_.at(frame), frame);
        if (!header.ok()) return header.status();
        std::string work =
            offline::work_text(variants_[v].chain, settings_.run, *header, files_.at(frame), frame);
        work += concat(" kept ", kept(frame), " split ", split(frame));
        if (truth_) work += " truth " + truth_->identity(frame);
        return work;
    }

    std::string name_of_variant(size_t v) const { return hex_of(report_.variants[v].chain_hash); }
    bool kept(int frame) const {
        return std::find(report_.page_frames.begin(), report_.page_frames.end(), frame) !=
               report_.page_frames.end();
    }
    bool split(int frame) const {
        return std::find(split_frames_.begin(), split_frames_.end(), frame) != split_frames_.end();
    }

    // ---------------------------------------------------------------------------- resume
    // Takes what an earlier run has left and returns the frames on which something is open.
    std::vector<int> frames_to_do() {
        results_.resize(variants_.size());
        std::vector<int> open;
        for (int frame : report_.frames) {
            bool whole = !kept(frame) || take_common(frame);
            for (size_t v = 0; v < variants_.size(); ++v) {
                auto work = work_of(v, frame);
                auto result =
                    work.ok() ? store_->frame(name_of_variant(v), frame, *work) : std::nullopt;
                if (!result || (kept(frame) && !take_pictures(v, frame))) {
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

    StoredImage entry(ImageKind kind, int variant, int frame, const std::string& name) const {
        StoredImage image;
        image.kind = kind;
        image.variant = variant;
        image.frame = frame;
        image.path = image_path(name, frame);
        if (kind == ImageKind::error) image.map = "hdr_flip";
        return image;
    }
    bool take_common(int frame) {
        return take_stored_image(report_, entry(ImageKind::input, -1, frame, "input")) &&
               (!truth_ || take_stored_image(report_, entry(ImageKind::truth, -1, frame, "truth")));
    }
    bool take_pictures(size_t v, int frame) {
        const std::string name = name_of_variant(v);
        return take_stored_image(report_, entry(ImageKind::color, int(v), frame, name)) &&
               take_stored_image(report_,
                                 entry(ImageKind::error, int(v), frame, name + ".hdr_flip"));
    }

    // ---------------------------------------------------------------------------- frames
    Status measure_frames(const std::vector<int>& open) {
        if (open.empty()) return Status();
        offline::RunSettings run = settings_.run;
        run.frames = io::FrameRange{open};
        auto summary = offline::visit_sequence(
            run, wanted_,
            [&](offline::SourceFrame& frame, offline::FrameReport&) { return visit(frame); },
            [&](const offline::FrameReport& frame, const offline::RunProgress&) {
                for (const auto& warning : frame.warnings)
                    if (std::find(report_.notes.begin(), report_.notes.end(), warning) ==
                        report_.notes.end())
                        report_.notes.push_back(warning);
            },
            stop_);
        if (!summary.ok()) return summary.status();
        if (stopped()) return Status(StatusCode::cancelled, "stopped; the same command goes on");
        return summary->first_failure;
    }

    bool stopped() const { return stop_ && *stop_; }

    Status visit(offline::SourceFrame& frame) {
        const int number = frame.description.frame_number;
        auto input = metrics::picture_of(frame.planes.at(Role::color));
        if (!input.ok()) return input.status();
        std::optional<metrics::Picture> truth;
        if (truth_) {
            auto loaded = truth_->load(number);
            if (!loaded.ok()) return loaded.status();
            truth = std::move(*loaded);
        }
        if (kept(number)) {
            Status status =
                store_image(report_, entry(ImageKind::input, -1, number, "input"), input->rgb);
            if (status.ok() && truth)
                status =
                    store_image(report_, entry(ImageKind::truth, -1, number, "truth"), truth->rgb);
            if (!status.ok()) return status;
        }
        converged_.clear();
        for (size_t v = 0; v < variants_.size(); ++v) {
            if (stopped()) return Status(StatusCode::cancelled, "stopped");
            if (results_[v].count(number)) continue;
            progress_->at(concat("frame ", number, ", ", variants_[v].name));
            bool writing = false;
            const Status status =
                measure_variant(v, frame, *input, truth ? &*truth : nullptr, writing);
            // What cannot be written now cannot be written for the others either.
            if (!status.ok() && writing) return status;
            if (!status.ok()) {
                std::string& failure = report_.variants[v].failure;
                failure +=
                    concat(failure.empty() ? "" : "; ", "frame ", number, ": ", status.message());
            }
            progress_->finished();
        }
        return Status();
    }

    Status measure_variant(size_t v, const offline::SourceFrame& frame,
                           const metrics::Picture& input, const metrics::Picture* truth,
                           bool& writing) {
        const Chain& chain = variants_[v].chain;
        const int number = frame.description.frame_number;
        auto plan = offline::plan_source_frame(chain, frame, settings_.run.plan);
        if (!plan.ok()) return plan.status();
        auto filtered = executor_.filter(*plan, frame.planes);
        if (!filtered.ok()) return filtered.status();
        const ImageF& color = filtered->at(Role::color);
        const Converged* converged = nullptr;
        if (!truth || split(number)) {
            auto found = converge_once(chain, frame);
            if (!found.ok()) return found.status();
            converged = *found;
        }
        auto pair = metrics::pair_of(color, truth ? truth->rgb : converged->rgb);
        if (!pair.ok()) return pair.status();
        auto measured = measure(*pair, truth ? &input : nullptr, exposures_, settings_.flip, false);
        if (!measured.ok()) return measured.status();
        FrameResult result;
        result.metrics = std::move(measured->values);
        result.left_out = plan->left_out;
        if (split(number)) {
            auto reference =
                run_reference(chain, frame.description, frame.planes, settings_.run.plan);
            if (!reference.ok()) return reference.status();
            auto parts = split_error(number, color, reference->planes.at(Role::color), *converged,
                                     truth, exposures_, settings_.flip);
            if (!parts.ok()) return parts.status();
            if (!truth) parts->notes.push_back("model error is left out: " + report_.no_truth);
            result.split = std::move(*parts);
        }
        writing = true;
        if (kept(number)) {
            const std::string name = name_of_variant(v);
            Status status =
                store_image(report_, entry(ImageKind::color, int(v), number, name), color);
            if (status.ok())
                status = store_image(report_,
                                     entry(ImageKind::error, int(v), number, name + ".hdr_flip"),
                                     measured->maps.at("hdr_flip"));
            if (!status.ok()) return status;
        }
        auto work = work_of(v, number);
        if (!work.ok()) return work.status();
        if (Status status = store_->keep(name_of_variant(v), number, *work, result); !status.ok())
            return status;
        results_[v][number] = std::move(result);
        return Status();
    }

    // Variants that differ only in rows that converge share one converged picture.
    Result<const Converged*> converge_once(const Chain& chain, const offline::SourceFrame& frame) {
        const std::string text = converged_chain(chain, nullptr).text();
        auto found = converged_.find(text);
        if (found == converged_.end()) {
            auto made =
                converge(chain, frame.description, frame.planes, settings_.run.plan, executor_);
            if (!made.ok()) return made.status();
            found = converged_.emplace(text, std::move(*made)).first;
        }
        // What had to change is the variant's own.
        found->second.changes.clear();
        converged_chain(chain, &found->second.changes);
        return &found->second;
    }

    // ----------------------------------------------------------------------------- times
    Status time_all() {
        const int frame = report_.frames.front();
        std::optional<offline::SourceFrame> source;
        for (size_t v = 0; v < variants_.size(); ++v) {
            if (stopped())
                return Status(StatusCode::cancelled, "stopped; the same command goes on");
            Variant& variant = report_.variants[v];
            if (!variant.timing && !variant.failure.empty()) {
                progress_->finished();
            } else if (!variant.timing) {
                progress_->at("timing " + variant.name);
                auto work = work_of(v, frame);
                if (!work.ok()) return work.status();
                if (Status status = time_one(v, frame, source); !status.ok()) return status;
                if (variant.timing)
                    if (Status status = store_->keep(name_of_variant(v), *work, *variant.timing);
                        !status.ok())
                        return status;
                progress_->finished();
            }
            if (variant.timing && !variant.timing->trustworthy)
                report_.notes.push_back("times of " + variant.name +
                                        " are not to be trusted: " + variant.timing->why_not);
        }
        return Status();
    }

    Status time_one(size_t v, int frame, std::optional<offline::SourceFrame>& source) {
        if (!source) {
            auto header = offline::open_source_frame(settings_.run.source, files_.at(frame), frame);
            if (!header.ok()) return header.status();
            auto read = offline::read_source_frame(settings_.run.source, std::move(*header),
                                                   wanted_, io::Keep::nothing);
            if (!read.ok()) return read.status();
            source = std::move(*read);
            source->description.frame_number = frame;
        }
        Variant& variant = report_.variants[v];
        auto plan = offline::plan_source_frame(variants_[v].chain, *source, settings_.run.plan);
        auto timing = plan.ok() ? time_plan(executor_, *plan, source->planes, settings_.repeats)
                                : Result<Timing>(plan.status());
        if (timing.ok())
            variant.timing = std::move(*timing);
        else
            variant.failure = "timing: " + timing.status().message();
        return Status();
    }

    // --------------------------------------------------------------------------- results
    Status finish() {
        std::vector<std::pair<WorstTile, std::string>> worst;
        const size_t count = report_.frames.size();
        for (size_t v = 0; v < variants_.size(); ++v) {
            Variant& variant = report_.variants[v];
            std::vector<ErrorSplit> splits;
            for (size_t i = 0; i < count; ++i) {
                const auto result = results_[v].find(report_.frames[i]);
                if (result == results_[v].end()) continue;
                for (const auto& [name, value] : result->second.metrics)
                    set_value(variant, name, i, count, value);
                for (const LeftOut& left : result->second.left_out)
                    variant.left_out.emplace_back(report_.frames[i], left);
                if (result->second.split) splits.push_back(*result->second.split);
            }
            find_means(variant);
            if (!splits.empty()) variant.split = mean_split(splits);
            for (int frame : report_.page_frames) {
                const StoredImage* map = report_.find(ImageKind::error, int(v), frame);
                if (!map) continue;
                auto pixels = load_image(report_, *map);
                if (!pixels.ok()) return pixels.status();
                worst.emplace_back(worst_tile(*pixels, frame, kCropPx), variant.name);
            }
        }
        report_.crops = crops_of(std::move(worst), kCrops);
        mark_pareto(report_, kParetoMetric);
        return Status();
    }

    const std::vector<BenchVariant>& variants_;
    const BenchSettings& settings_;
    Executor& executor_;
    const std::atomic<bool>* stop_;
    ProgressMeter* progress_ = nullptr;
    Report report_;
    std::optional<Truth> truth_;
    std::optional<BenchStore> store_;
    metrics::ExposureRange exposures_;
    std::vector<int> split_frames_;
    std::map<int, std::map<Role, std::string>> files_;
    RoleSet wanted_;
    std::vector<std::map<int, FrameResult>> results_;  // of each variant
    std::map<std::string, Converged> converged_;       // of the frame under way
    size_t done_ = 0;                                  // units taken from an earlier run
};

}  // namespace

Result<Report> run_bench(const std::vector<BenchVariant>& variants, const BenchSettings& settings,
                         Executor& executor, const ProgressCallback& progress,
                         const std::atomic<bool>* stop) {
    return BenchRun(variants, settings, executor, stop).run(progress);
}

}  // namespace postchain::report
