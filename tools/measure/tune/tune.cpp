#include "tools/measure/tune/tune.h"

#include <algorithm>
#include <charconv>
#include <chrono>
#include <cmath>
#include <span>

#include "chain/base/text.h"
#include "tools/measure/experiment/converge.h"
#include "tools/measure/experiment/experiment_input.h"
#include "tools/measure/experiment/result_store.h"
#include "tools/measure/experiment/timing.h"
#include "tools/measure/report/words.h"
#include "tools/sequence/settings/run_settings.h"
#include "tools/sequence/source/frame_plan.h"

namespace postchain::tune {
namespace {

constexpr const char* kMetric = "hdr_flip";
constexpr int kReferenceSeeds = 2;     // averaged in a converged image
constexpr double kGiveUp = 2;          // budgets beyond which a chain is not measured further
constexpr int kConfirmingRepeats = 2;  // times the repetitions of the first timing

struct ShotFrame {
    sequence::SourceFrame source;
    metrics::RgbImage reference;
};

bool same_work(const Plan& a, const Plan& b) {
    return a.steps == b.steps && a.textures == b.textures && a.outputs == b.outputs;
}

// Measures chains on the frames of a shot, which it holds in memory.
class Shot final : public ChainEvaluator {
  public:
    Shot(const TuneSettings& settings, const Goal& goal, Executor& executor,
         const experiment::ProgressCallback& progress)
        : settings_(settings), goal_(goal), executor_(executor), progress_(progress) {}

    // Reads the frames and their references. `wanted`: planes that some chain may read.
    // `converging`: the chain whose converged image is the reference without a ground truth.
    Status open(const experiment::ExperimentInput& input, const std::vector<int>& numbers,
                RoleSet wanted, const Chain& converging) {
        exposures_ = input.exposures;
        for (const int number : numbers) {
            ASSIGN_OR_RETURN(auto source,
                             experiment::read_frame(input, settings_.run, number, wanted));
            for (const auto& note : experiment::notes_on_neighbors(source)) notes_.push_back(note);
            metrics::RgbImage reference;
            if (input.truth) {
                ASSIGN_OR_RETURN(reference, input.truth->load(number));
            } else {
                say(concat("frame ", number, ": the converged image"));
                // plan_source_frame() explains what a frame lacks.
                ASSIGN_OR_RETURN(
                    auto plan, sequence::plan_source_frame(converging, source, settings_.run.plan));
                ASSIGN_OR_RETURN(
                    auto converged,
                    experiment::converge(converging, source.description, source.planes,
                                         settings_.run.plan, executor_, kReferenceSeeds));
                ASSIGN_OR_RETURN(reference, metrics::rgb_image_of(converged.rgb));
                changes_ = converged.changes;
            }
            frames_.push_back({std::move(source), std::move(reference)});
        }
        return Status();
    }

    Result<Measured> measure(const Chain& chain) override {
        say(knobs_text(chain));
        ASSIGN_OR_RETURN(auto plans, plans_of(chain));
        for (const auto& [known, measured] : known_)
            if (std::equal(plans.begin(), plans.end(), known.begin(), same_work)) return measured;
        Measured measured;
        double error = 0;
        for (size_t i = 0; i < frames_.size(); ++i) {
            // Warms up too: it compiles.
            ASSIGN_OR_RETURN(auto filtered, executor_.filter(plans[i], frames_[i].source.planes));
            if (i == 0 && goal_.budget_s) {
                ASSIGN_OR_RETURN(auto once, times_of({&plans[0], 1}, 1));
                if (once.seconds > kGiveUp * *goal_.budget_s)
                    return keep(std::move(plans), {.times = std::move(once), .error = {}});
            }
            ASSIGN_OR_RETURN(auto of_frame,
                             error_of(filtered.at(Role::color), frames_[i].reference));
            error += of_frame / double(frames_.size());
        }
        ASSIGN_OR_RETURN(auto times, times_of(plans, settings_.repeats));
        return keep(std::move(plans), {.times = std::move(times), .error = error});
    }

    Result<Times> time_again(const Chain& chain) override {
        say("timing again: " + knobs_text(chain));
        ASSIGN_OR_RETURN(auto plans, plans_of(chain));
        // Compiles, if the chain was measured before a stop.
        for (size_t i = 0; i < plans.size(); ++i)
            RETURN_IF_ERROR(executor_.filter(plans[i], frames_[i].source.planes).status());
        return times_of(plans, kConfirmingRepeats * settings_.repeats);
    }

    const std::vector<std::string>& notes() const { return notes_; }
    // The changes by converging, in words.
    const std::vector<std::string>& changes() const { return changes_; }

  private:
    void say(const std::string& what) {
        const double now =
            std::chrono::duration<double>(std::chrono::steady_clock::now() - began_).count();
        if (progress_)
            progress_({.what = what,
                       .done = known_.size(),
                       .total = size_t(settings_.max_chains),
                       .elapsed_s = now});
    }

    Result<std::vector<Plan>> plans_of(const Chain& chain) const {
        std::vector<Plan> plans;
        for (const ShotFrame& frame : frames_) {
            ASSIGN_OR_RETURN(auto plan,
                             sequence::plan_source_frame(chain, frame.source, settings_.run.plan));
            plans.push_back(std::move(plan));
        }
        return plans;
    }

    // Times the first plans.size() frames, whose programs are compiled.
    Result<Times> times_of(std::span<const Plan> plans, int repeats) {
        Times times;
        times.repeats = repeats;
        for (size_t i = 0; i < plans.size(); ++i) {
            ASSIGN_OR_RETURN(
                auto timing,
                experiment::time_plan(executor_, plans[i], frames_[i].source.planes, repeats, 0));
            times.seconds += 1e-3 * timing.total.median_ms / double(plans.size());
            times.spread_s += 1e-3 * timing.total.spread_ms / double(plans.size());
            if (!timing.trustworthy) times.doubt = timing.why_not;
        }
        return times;
    }

    Result<double> error_of(const ImageF& color, const metrics::RgbImage& reference) const {
        ASSIGN_OR_RETURN(auto test, metrics::rgb_image_of(color));
        ASSIGN_OR_RETURN(auto pair, metrics::pair_of(std::move(test), reference));
        metrics::CompareSettings compare;
        compare.metrics = {kMetric};
        compare.flip = settings_.flip;
        compare.exposures = exposures_;
        ASSIGN_OR_RETURN(auto compared, metrics::compare(pair, compare));
        return *compared.value(kMetric);
    }

    Measured keep(std::vector<Plan> plans, Measured measured) {
        known_.emplace_back(std::move(plans), measured);
        return measured;
    }

    const TuneSettings& settings_;
    const Goal& goal_;
    Executor& executor_;
    const experiment::ProgressCallback& progress_;
    const std::chrono::steady_clock::time_point began_ = std::chrono::steady_clock::now();
    metrics::ExposureRange exposures_;
    std::vector<ShotFrame> frames_;
    // By their plans: chains that differ only in knobs without effect here are one.
    std::vector<std::pair<std::vector<Plan>, Measured>> known_;
    std::vector<std::string> notes_, changes_;
};

// Measures only what a stopped walk has not.
class Continued final : public ChainEvaluator {
  public:
    Continued(const StoppedWalk* earlier, ChainEvaluator& rest) : earlier_(earlier), rest_(rest) {}

    Result<Measured> measure(const Chain& chain) override {
        if (const auto* point = find(chain)) return point->measured;
        return rest_.measure(chain);
    }
    Result<Times> time_again(const Chain& chain) override {
        if (const auto* point = find(chain); point && point->confirmed)
            return point->measured.times;
        return rest_.time_again(chain);
    }

  private:
    const StoppedWalk::Point* find(const Chain& chain) const {
        if (!earlier_) return nullptr;
        const auto point = earlier_->by_hash.find(chain.hash());
        return point == earlier_->by_hash.end() ? nullptr : &point->second;
    }

    const StoppedWalk* earlier_;
    ChainEvaluator& rest_;
};

// Everything that the figures depend on, but the number of chains.
Result<std::string> key_of(const std::vector<Start>& starts, const std::vector<std::string>& fixed,
                           const std::vector<int>& frames, const TuneSettings& settings,
                           const experiment::ExperimentInput& input,
                           const report::Report& conditions) {
    RuleNames rules;
    for (const Start& start : starts) rules.merge(settings.run.plan.rules(start.chain));
    std::string text =
        concat(experiment::conditions_of(conditions, settings, rules), settings.budget, " ",
               settings.error.value_or(0), " ", joined(fixed), "\n");
    for (const Start& start : starts)
        for (const int frame : frames) {
            ASSIGN_OR_RETURN(const auto key, experiment::key_of_result(
                                                 start.chain, frame, start.name, settings, input));
            text += key + "\n";
        }
    return hex_of(hash_text(text));
}

// A few of the frames with a ground truth.
Result<std::vector<int>> frames_to_measure(const TuneSettings& settings) {
    ASSIGN_OR_RETURN(auto list, experiment::frames_on_disk(settings.run));
    if (settings.truth.empty())
        return experiment::spread_frames(list.frames, settings.measure_frames);
    ASSIGN_OR_RETURN(auto truth, experiment::Truth::open(settings.truth, list.frames));
    return experiment::spread_frames(truth.frames(), settings.measure_frames);
}

RoleSet planes_of(const std::vector<Start>& starts) {
    RoleSet wanted;
    for (const Start& start : starts)
        for (const Chain& chain : {start.chain.clone(), without_shortcuts(start.chain)})
            wanted = wanted | chain.required() | chain.optional();
    return wanted;
}

std::string converged_words(const Start& start, const std::vector<std::string>& changes) {
    return concat("no ground truth: the converged image of ", start.name, " itself (",
                  knobs_text(without_shortcuts(start.chain)), "; ", joined(changes), "; mean of ",
                  kReferenceSeeds, " seeds), so the error of its method is not counted");
}

}  // namespace

const ParameterTable& tune_parameters() {
    static const ParameterTable table =
        experiment::measuring_rows<TuneSettings>()
            .text("output", &TuneSettings::folder,
                  {.unit = "FILE", .help = "the chain file to write", .required = true})
            .choice("on_existing",
                    static_cast<io::OnExisting TuneSettings::*>(&TuneSettings::on_existing),
                    {"fail", "overwrite"}, {.help = "if the chain file exists"})
            .text("budget", &TuneSettings::budget,
                  {.unit = "TIME",
                   .help = "find the least error within this time per frame on this device: 0.2, "
                           "0.2s, 200ms",
                   .unset_means = "{error} decides"_keyed})
            .number("error", &TuneSettings::error,
                    {.min = 0,
                     .max = 1,
                     .min_excluded = true,
                     .help = "find the least time within this mean HDR-FLIP",
                     .unset_means = "{budget} decides"_keyed})
            .integer("measure_frames", &TuneSettings::measure_frames,
                     {.min = 1, .max = 100, .help = "frames that are measured, evenly spaced"})
            .integer("max_chains", &TuneSettings::max_chains,
                     {.min = 1, .max = 1000, .help = "chains that are measured at most"})
            .table();
    return table;
}

Result<Goal> goal_of(const TuneSettings& settings) {
    if (settings.budget.empty() == !settings.error)
        return Status(StatusCode::usage,
                      settings.error ? "{budget} and {error}: give one of the two"_keyed
                                     : "give a time per frame ({budget=0.2s}) or a mean HDR-FLIP "
                                       "({error=0.07})"_keyed);
    if (settings.error && !(*settings.error > 0))
        return Status(StatusCode::usage,
                      "{error}: a mean HDR-FLIP is above 0; reports of bench "
                      "have typical values"_keyed);
    if (settings.error) return Goal{.budget_s = {}, .error = settings.error};
    const std::string& text = settings.budget;
    double value = 0;
    const auto read = std::from_chars(text.data(), text.data() + text.size(), value);
    const std::string unit(read.ptr, text.data() + text.size() - read.ptr);
    if (unit == "ms") value *= 1e-3;
    if (read.ec != std::errc() || (unit != "" && unit != "s" && unit != "ms") ||
        !std::isfinite(value) || value <= 0)
        return Status(StatusCode::usage, "{budget}: '"_keyed + text +
                                             "' is not a time above 0; use a form like 0.2, 0.2s "
                                             "or 200ms");
    return Goal{.budget_s = value, .error = {}};
}

std::vector<std::string> default_starts(bool with_truth) {
    if (with_truth) return {"fast", "balanced", "best"};
    return {"balanced"};
}

Result<Tuning> run_tune(std::vector<Start> starts, const std::vector<std::string>& fixed,
                        const TuneSettings& given, Executor& executor,
                        const experiment::ProgressCallback& progress, const std::atomic<bool>* stop,
                        const StoppedWalk* earlier) {
    ASSIGN_OR_RETURN(auto goal, goal_of(given));
    if (given.truth.empty() && starts.size() != 1)
        return Status(StatusCode::usage,
                      concat("without a ground truth a chain is measured against its own converged "
                             "image, but ",
                             starts.size(), " chains are given; name one, or give {truth}"_keyed));
    TuneSettings settings = given;
    std::vector<const Chain*> chains;
    for (const Start& start : starts) chains.push_back(&start.chain);
    settings.run = sequence::settings_for(settings.run, chains);
    settings.run.plan.device = executor.device_class();
    ASSIGN_OR_RETURN(auto numbers, frames_to_measure(settings));
    settings.run.frames = io::FrameRange{numbers};
    report::Report conditions;
    ASSIGN_OR_RETURN(auto input, experiment::open_input(report::Kind::bench, settings, conditions));

    Tuning tuning;
    ASSIGN_OR_RETURN(tuning.key, key_of(starts, fixed, numbers, settings, input, conditions));
    if (earlier && earlier->key != tuning.key)
        return Status(StatusCode::output,
                      settings.folder +
                          ": is of a stopped walk with other settings, frames or "
                          "device; use {on_existing=overwrite}, or name another "
                          "with {output}"_keyed);
    const StopScope within_a_frame(executor, stop);
    Shot shot(settings, goal, executor, progress);
    RETURN_IF_ERROR(
        shot.open(input, numbers, planes_of(starts), without_shortcuts(starts.front().chain)));
    tuning.with_truth = input.truth.has_value();
    tuning.reference = tuning.with_truth ? "ground truth " + *conditions.truth
                                         : converged_words(starts.front(), shot.changes());
    const auto steps = [&](const Chain& chain) {
        return steps_from(chain, fixed, tuning.with_truth);
    };
    Continued evaluator(earlier, shot);
    ASSIGN_OR_RETURN(auto found,
                     search_front(std::move(starts), steps, goal, settings.max_chains, evaluator));
    RETURN_IF_ERROR(input.check_unchanged());
    tuning.goal = goal;
    tuning.search = std::move(found);
    tuning.version = conditions.version;
    tuning.input = settings.input;
    tuning.frames =
        concat(sequence::frames_text(numbers), " (", conditions.width, "x", conditions.height, ")");
    tuning.device = concat(conditions.renderer, ", ", conditions.precision);
    if (conditions.software) tuning.device += concat(", ", conditions.threads, " threads");
    tuning.timing = executor.timing_source();
    tuning.notes = shot.notes();
    return tuning;
}

}  // namespace postchain::tune
