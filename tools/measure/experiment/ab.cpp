#include "tools/measure/experiment/ab.h"

#include <algorithm>

#include "chain/merge.h"
#include "config/chain_file.h"
#include "tools/measure/experiment/basis.h"
#include "tools/measure/experiment/outcome.h"
#include "tools/measure/experiment/report_folder.h"
#include "tools/measure/experiment/statistics.h"
#include "tools/measure/experiment/temporal_stability.h"
#include "tools/measure/experiment/timing.h"
#include "tools/measure/experiment/verdict.h"
#include "tools/measure/metrics/temporal.h"
#include "tools/measure/report/images.h"
#include "tools/measure/report/lists.h"
#include "tools/sequence/run/runner.h"
#include "tools/sequence/source/frame_plan.h"

namespace postchain::experiment {
namespace {

class AbRun {
  public:
    AbRun(const NamedChain& a, const NamedChain& b, const ExperimentSettings& settings,
          Executor& executor, const std::atomic<bool>* stop)
        : chains_{&a, &b}, settings_(settings), executor_(executor), stop_(stop) {}

    Result<report::Report> run(const ProgressCallback& callback) {
        RETURN_IF_ERROR(start());
        // Timing one chain counts as much as one frame.
        ProgressMeter progress(report_.frames.size() + 2, 0, callback);
        progress_ = &progress;
        auto summary = sequence::visit_sequence(
            settings_.run,
            chains_[0]->chain.required() | chains_[0]->chain.optional() |
                chains_[1]->chain.required() | chains_[1]->chain.optional(),
            [&](sequence::SourceFrame& frame, sequence::FrameReport& report) {
                const Status status = visit(frame);
                return status.ok() ? io::check_unchanged(report.stamps) : status;
            },
            [&](const sequence::FrameReport& frame, const sequence::RunProgress&) {
                for (const auto& warning : frame.warnings) note(warning);
            },
            stop_);
        if (!summary.ok()) return summary.status();
        if (stop_ && *stop_) return Status(StatusCode::canceled, "stopped");
        if (!summary->first_failure.ok()) return summary->first_failure;
        RETURN_IF_ERROR(time_both());
        RETURN_IF_ERROR(io::check_unchanged(basis_.stamps));
        for (report::Variant& variant : report_.variants) find_means(variant.metrics);
        find_means(report_.input_metrics);
        // Drops metrics that only filtered frames have, and metrics without any value.
        std::erase_if(report_.input_metrics, [](const auto& one) { return !one.second.mean; });
        find_means(report_.truth_noise);
        report_.crops = crops_of(std::move(worst_));
        report_.comparison = compare_variants(report_, tiles_);
        report_.comparison->shared_steps = shared_steps_;
        report_.comparison->steps_a = steps_[0];
        report_.comparison->steps_b = steps_[1];
        state_outcome(report_);
        return std::move(report_);
    }

  private:
    Status start() {
        report_.title = chains_[0]->name + " against " + chains_[1]->name;
        ASSIGN_OR_RETURN(basis_, open_basis(report::Kind::ab, settings_, report_));
        if (!basis_.truth)
            note("without a ground truth the metrics measure the distance of " + chains_[1]->name +
                 " from " + chains_[0]->name + ", not which is more accurate");
        ASSIGN_OR_RETURN(report_.files, prepare_folder(settings_));
        stability_frames_ = spread_frames(report_.frames, settings_.stability_frames);
        for (const NamedChain* chain : chains_) {
            report::Variant variant;
            variant.name = chain->name;
            variant.chain_text = write_chain(chain->chain);
            variant.passes = chain->chain.types();
            variant.chain_hash = chain->chain.hash();
            report_.variants.push_back(std::move(variant));
            for (const auto& seed : seeds_of(chain->chain))
                report_.seeds.push_back(chain->name + ": " + seed);
        }
        if (chains_[0]->name == chains_[1]->name) {
            report_.variants[0].name += " (A)";
            report_.variants[1].name += " (B)";
        }
        for (const char* metric : {"flip", "hdr_flip", "relmse", "smape", "mse"})
            tiles_.emplace(metric, TileBootstrap(kBootstrapSeed, kBootstrapReplicates));
        return Status();
    }

    static bool contains(const std::vector<int>& frames, int frame) {
        return std::find(frames.begin(), frames.end(), frame) != frames.end();
    }

    void note(const std::string& text) {
        auto& notes = report_.notes;
        if (std::find(notes.begin(), notes.end(), text) == notes.end()) notes.push_back(text);
    }

    void fail(size_t variant, int frame, const Status& status) {
        std::string& failure = report_.variants[variant].failure;
        failure += concat(failure.empty() ? "" : "; ", "frame ", frame, ": ", status.message());
    }

    // Results of both chains; empty for one that failed.
    std::array<std::optional<ImageF>, 2> filter(const sequence::SourceFrame& frame) {
        const int number = frame.description.frame_number;
        std::array<std::optional<Plan>, 2> plans;
        std::array<std::optional<ImageF>, 2> results;
        for (size_t v = 0; v < 2; ++v) {
            auto plan = sequence::plan_source_frame(chains_[v]->chain, frame, settings_.run.plan);
            if (!plan.ok()) {
                fail(v, number, plan.status());
                continue;
            }
            plans[v] = std::move(*plan);
        }
        if (plans[0] && plans[1]) {
            const MergedPlan merged = merge_plans(*plans[0], *plans[1]);
            if (steps_[0] < 0) {
                shared_steps_ = merged.shared_steps;
                steps_ = {int(plans[0]->steps.size()), int(plans[1]->steps.size())};
            }
            if (auto both = executor_.filter_both(merged, frame.planes); both.ok()) {
                for (size_t v = 0; v < 2; ++v) results[v] = std::move((*both)[v].at(Role::color));
                for (size_t v = 0; v < 2; ++v)
                    note_elisions(v, number, merged.elisions[v], merged.plan);
                return results;
            }
            // One of the chains failed; filtering separately shows which.
        }
        for (size_t v = 0; v < 2; ++v) {
            if (!plans[v]) continue;
            auto alone = executor_.filter(*plans[v], frame.planes);
            if (alone.ok())
                results[v] = std::move(alone->at(Role::color));
            else
                fail(v, number, alone.status());
            note_elisions(v, number, plans[v]->elisions, *plans[v]);
        }
        return results;
    }

    // `plan` is the executor's last plan.
    void note_elisions(size_t variant, int frame, const std::vector<Elision>& elisions,
                       const Plan& plan) {
        for (const Elision& elision : elisions)
            if (const auto found = found_in(elision, plan, executor_.work_done()))
                report_.variants[variant].elisions.emplace_back(frame, *found);
    }

    Status visit(sequence::SourceFrame& frame) {
        const int number = frame.description.frame_number;
        progress_->at(concat("frame ", number));
        for (const auto& text : notes_on_neighbors(frame)) note(text);
        const auto found = std::find(report_.frames.begin(), report_.frames.end(), number);
        const auto index = size_t(found - report_.frames.begin());
        const bool kept = contains(report_.page_frames, number);
        ASSIGN_OR_RETURN(auto input, metrics::rgb_image_of(*frame.planes.at(Role::color)));
        auto results = filter(frame);
        std::optional<metrics::RgbImage> reference;
        if (basis_.truth && !basis_.truth->has(number)) {
            // Filtered but not measured.
        } else if (basis_.truth) {
            ASSIGN_OR_RETURN(reference, basis_.truth->load(number));
        } else if (results[0]) {
            ASSIGN_OR_RETURN(reference, metrics::rgb_image_of(*results[0]));
        }
        if (kept) {
            RETURN_IF_ERROR(store(report::ImageKind::input, -1, number, "input", input.rgb));
            if (basis_.truth)
                RETURN_IF_ERROR(
                    store(report::ImageKind::truth, -1, number, "truth", reference->rgb));
        }
        std::array<std::map<std::string, ImageF>, 2> maps;
        for (size_t v = basis_.truth ? 0 : 1; v < 2 && reference; ++v) {
            if (!results[v]) continue;
            ASSIGN_OR_RETURN(auto pair, metrics::pair_of(*results[v], reference->rgb));
            RETURN_IF_ERROR(judge(report_.variants[v].metrics, steps_in_time_[v], index, pair,
                                  basis_.truth ? &input : nullptr, maps[v]));
        }
        if (basis_.truth && reference)
            RETURN_IF_ERROR(score_input(input, *reference, index, number, kept));
        for (size_t v = 0; v < 2 && contains(stability_frames_, number); ++v) {
            if (!results[v]) continue;
            ASSIGN_OR_RETURN(auto stability,
                             temporal_stability(chains_[v]->chain, frame, *results[v],
                                                settings_.run.plan, executor_));
            const size_t count = report_.frames.size();
            set_value(report_.variants[v].metrics, "flicker", index, count, stability.flicker);
            set_value(report_.variants[v].metrics, "grid", index, count, stability.grid);
        }
        for (size_t v = 0; v < 2 && kept; ++v) {
            if (!results[v]) continue;
            const std::string name = v == 0 ? "a" : "b";
            RETURN_IF_ERROR(store(report::ImageKind::color, int(v), number, name, *results[v]));
            if (maps[v].empty()) continue;
            for (const char* map : kStoredMaps)
                RETURN_IF_ERROR(store(report::ImageKind::error, int(v), number,
                                      concat(name, ".", map), maps[v].at(map), map));
            worst_.emplace_back(worst_tile(maps[v].at("hdr_flip"), number, kCropPx),
                                report_.variants[v].name);
        }
        if (basis_.truth)
            for (auto& [metric, bootstrap] : tiles_)
                if (maps[0].count(metric) && maps[1].count(metric))
                    bootstrap.add(number, tile_sums(maps[0].at(metric), maps[1].at(metric),
                                                    kBootstrapTilePx));
        progress_->finished();
        return Status();
    }

    // Last frame measured for a variant or for the input.
    struct StepsInTime {
        metrics::TemporalError error;
        int last_index = -2;
    };

    Status judge(report::Metrics& metrics, StepsInTime& steps, size_t index,
                 const metrics::Pair& pair, const metrics::RgbImage* input,
                 std::map<std::string, ImageF>& maps) {
        ASSIGN_OR_RETURN(auto measured,
                         measure(pair, input, basis_.exposures, settings_.flip, true));
        const size_t count = report_.frames.size();
        for (const auto& column : report_.metrics) {
            const auto value = measured.values.find(column.name);
            set_value(metrics, column.name, index, count,
                      value == measured.values.end() ? std::nullopt
                                                     : std::optional<double>(value->second));
        }
        // Differences over time need consecutive frame numbers.
        const bool follows = index > 0 && report_.frames[index] == report_.frames[index - 1] + 1 &&
                             steps.last_index == int(index) - 1;
        if (!follows) steps.error = metrics::TemporalError();
        RETURN_IF_ERROR(steps.error.add(pair));
        steps.last_index = int(index);
        set_value(metrics, "tde", index, count, follows ? steps.error.last() : std::nullopt);
        maps = std::move(measured.maps);
        return Status();
    }

    // Scores the unfiltered input, to show whether filtering helped, and measures the noise of the
    // ground truth.
    Status score_input(const metrics::RgbImage& input, const metrics::RgbImage& truth, size_t index,
                       int number, bool kept) {
        ASSIGN_OR_RETURN(auto pair, metrics::pair_of(input, truth));
        std::map<std::string, ImageF> maps;
        Status status =
            judge(report_.input_metrics, steps_in_time_of_input_, index, pair, &input, maps);
        ASSIGN_OR_RETURN(auto noise, noise_of_truth(truth, input));
        for (const auto& [name, value] : noise)
            set_value(report_.truth_noise, name, index, report_.frames.size(), value);
        for (const char* map : kStoredMaps)
            if (status.ok() && kept)
                status = store(report::ImageKind::error, -1, number, concat("input.", map),
                               maps.at(map), map);
        return status;
    }

    Status store(report::ImageKind kind, int variant, int frame, const std::string& name,
                 const ImageF& pixels, const std::string& map = {}) {
        return report::store_image(report_, report::stored_image(kind, variant, frame, name, map),
                                   pixels);
    }

    // Times each chain separately on the first frame while nothing else in this process runs.
    Status time_both() {
        const int frame = report_.frames.front();
        for (size_t v = 0; v < 2; ++v) {
            progress_->at("timing " + report_.variants[v].name);
            const Chain& chain = chains_[v]->chain;
            ASSIGN_OR_RETURN(auto source, read_frame(basis_, settings_.run, frame,
                                                     chain.required() | chain.optional()));
            auto plan = sequence::plan_source_frame(chain, source, settings_.run.plan);
            if (plan.ok()) {
                ASSIGN_OR_RETURN(report_.variants[v].timing,
                                 time_plan(executor_, *plan, source.planes, settings_.repeats));
            }
            if (stop_ && *stop_) return Status(StatusCode::canceled, "stopped");
            progress_->finished();
        }
        const std::string doubt = report::doubt_about_times(report_);
        if (!doubt.empty()) note(doubt);
        return Status();
    }

    const std::array<const NamedChain*, 2> chains_;
    const ExperimentSettings& settings_;
    Executor& executor_;
    const std::atomic<bool>* stop_;
    ProgressMeter* progress_ = nullptr;
    report::Report report_;
    Basis basis_;
    std::vector<int> stability_frames_;
    std::array<StepsInTime, 2> steps_in_time_;
    StepsInTime steps_in_time_of_input_;
    std::map<std::string, TileBootstrap> tiles_;
    std::vector<std::pair<WorstTile, std::string>> worst_;
    int shared_steps_ = 0;
    std::array<int, 2> steps_ = {-1, -1};
};

}  // namespace

Result<report::Report> run_ab(const NamedChain& a, const NamedChain& b,
                              const ExperimentSettings& settings, Executor& executor,
                              const ProgressCallback& progress, const std::atomic<bool>* stop) {
    ExperimentSettings with_mattes = settings;
    with_mattes.run = sequence::settings_for(settings.run, {&a.chain, &b.chain});
    const StopScope within_a_frame(executor, stop);
    return AbRun(a, b, with_mattes, executor, stop).run(progress);
}

}  // namespace postchain::experiment
