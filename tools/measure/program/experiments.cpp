// postchain ab and bench: run experiments with messages, progress and signals.
#include "tools/measure/program/subcommands.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <optional>

#include "chain/base/printable.h"
#include "config/chain_find.h"
#include "passes/registry.h"
#include "tools/apps/common/checks.h"
#include "tools/apps/common/log.h"
#include "tools/apps/common/stop_on_signal.h"
#include "tools/measure/experiment/experiment_input.h"
#include "tools/measure/experiment/outcome.h"
#include "tools/measure/experiment/report_folder.h"
#include "tools/measure/experiment/run_experiment.h"
#include "tools/measure/experiment/settings.h"
#include "tools/measure/experiment/sweep.h"
#include "tools/measure/report/report.h"
#include "tools/measure/report/words.h"
#include "tools/sequence/run/device.h"

namespace postchain {
namespace {

struct ExperimentOptions {
    experiment::ExperimentSettings ab;
    experiment::BenchSettings bench;
    std::string chain_b;  // of ab; A is Options::chain
    std::vector<std::string> fail_above;
    std::vector<std::string> sweeps;  // of bench
    std::vector<std::string> under;   // of bench
};

void add_experiment(CLI::App& subcommand, Options& o, ExperimentOptions& e,
                    const ParameterTable& table, ParameterRef settings,
                    const std::vector<std::string>& chains) {
    add_list(subcommand, "--set", "KEY=VALUE", o.sets, "change a value of the chain, as in run");
    add_settings(subcommand, job_parameters(), sequence::kInputGroup, &o.job);
    add_settings(subcommand, table, "", settings);
    add_list(subcommand, "--fail-above", "METRIC=NUMBER", e.fail_above,
             "exit with 8 if a variant's mean exceeds it, may be repeated: flip=0.05");
    add_settings(subcommand, job_parameters(), sequence::kPlanGroup, &o.job);
    add_device(subcommand, o);
    subcommand.add_flag("--json", o.json, kJsonHelp);
    add_progress(subcommand, o);
    add_confine(subcommand, o);
    add_checks(subcommand, o, chains);
}

// Adds the settings outside the tables: those of the run and of this process.
void complete(experiment::ExperimentSettings& settings, sequence::RunSettings run, const Options& o,
              const std::vector<std::string>& chains, const std::vector<Camera>& cameras) {
    experiment::complete(settings,
                         {std::move(run), o.job.input, chains, cameras, o.command_line, o.threads});
}

Result<std::vector<experiment::NamedChain>> variants_of(const Options& options,
                                                        const ExperimentOptions& e) {
    ASSIGN_OR_RETURN(const auto chain, find_chain_of(options));
    std::vector<experiment::Sweep> sweeps;
    for (const auto& text : e.sweeps) {
        ASSIGN_OR_RETURN(auto sweep, experiment::parse_sweep(text));
        sweeps.push_back(std::move(sweep));
    }
    return experiment::sweep_variants(chain, builtin_passes(), options.sets, sweeps,
                                      e.bench.max_variants);
}

// The input, the ground truth and the folder of a report. Prints what --check finds.
int check_report(Checks& checks, const experiment::ExperimentSettings& settings, bool confined) {
    const sequence::RunSettings& run = settings.run;
    const auto list = checks.take(run.frames ? "frames" : "input", experiment::frames_on_disk(run));
    if (list && !settings.truth.empty())
        checks.take("truth", experiment::Truth::open(settings.truth, list->frames).status());
    const Status folder = experiment::check_folder(settings);
    checks.take(folder.code() == StatusCode::usage ? "output" : "on_existing", folder);
    io::Json writes = {whole_path(settings.folder)};
    if (!settings.assets.empty()) writes.push_back(whole_path(settings.assets));
    if (confined) {
        checks.reads("input", run.input);
        if (const auto truth = io::InputSpec::parse(settings.truth); truth.ok())
            checks.reads("truth", *truth);
        checks.writes("output", settings.folder);
        if (!settings.assets.empty()) checks.writes("assets", settings.assets);
    }
    return checks.print({{"frames", list ? list->frames.size() : 0},
                         {"writes", std::move(writes)},
                         {"new_folder", settings.on_existing == io::OnExisting::fail}});
}

int check_ab(const Options& options, const ExperimentOptions& e) {
    Checks checks;
    Options of_b = options;
    of_b.chain = e.chain_b;
    const auto a = checks.chain("chain", options), b = checks.chain("chain_b", of_b);
    auto run = checks.settings(options);
    checks.take("fail_above", experiment::limits_of("fail_above", e.fail_above, report::Kind::ab,
                                                    !e.ab.truth.empty())
                                  .status());
    if (!checks.ok()) return checks.print({});
    experiment::ExperimentSettings settings = e.ab;
    complete(settings, std::move(*run), options, {options.chain, e.chain_b},
             {a->chain.camera, b->chain.camera});
    return check_report(checks, settings, !options.confine_to.empty());
}

int check_bench(const Options& options, const ExperimentOptions& e) {
    Checks checks;
    const auto chain = checks.chain("chain", options);
    std::optional<std::vector<experiment::NamedChain>> variants;
    if (chain) variants = checks.take("sweep", variants_of(options, e));
    auto run = checks.settings(options);
    for (const auto& [key, words] : {std::pair("fail_above", &e.fail_above), {"under", &e.under}})
        checks.take(key, experiment::limits_of(key, *words, report::Kind::bench, true).status());
    if (!checks.ok()) return checks.print({});
    experiment::BenchSettings settings = e.bench;
    std::vector<Camera> cameras;
    for (const auto& variant : *variants) cameras.push_back(variant.chain.camera);
    complete(settings, std::move(*run), options, {options.chain}, cameras);
    return check_report(checks, settings, !options.confine_to.empty());
}

// Time and error of each variant, cheapest first.
void print_curve(const report::Report& report) {
    const auto timed = report::by_time(report);
    size_t width = report.input_metrics.empty() ? 0 : std::string(report::kInputName).size();
    for (const auto* variant : timed) width = std::max(width, variant->name.size());
    const std::string& metric = report.pareto_metric;
    for (const auto* variant : timed) {
        const auto mean = report::mean_of(variant->metrics, metric);
        // Marks unreliable times, as on the page.
        std::printf("%-*s  %c%9.2f ms  %s %s%s\n", int(width), printable(variant->name).c_str(),
                    variant->timing->trustworthy ? ' ' : '~', variant->timing->total.median_ms,
                    metric.c_str(), mean ? report::figure(*mean).c_str() : "none",
                    variant->pareto ? "  in the Pareto set" : "");
    }
    if (const auto mean = report::mean_of(report.input_metrics, metric))
        std::printf("%-*s  %13s  %s %s\n", int(width), report::kInputName, "unfiltered",
                    metric.c_str(), report::figure(*mean).c_str());
}

std::string verdict_of(const report::Report& report) {
    std::string verdict;
    if (report.comparison) {
        verdict = report.comparison->verdict;
    } else {
        const auto best = std::ranges::count(report.variants, true, &report::Variant::pareto);
        verdict = concat(report.variants.size(),
                         report.variants.size() == 1 ? " variant, " : " variants, ", best,
                         " in the Pareto set");
        for (const std::string& line : report.under) verdict += "; " + line;
    }
    std::ranges::replace(verdict, '\n', ' ');
    return verdict;
}

// Writes the report's files and prints a summary. `met`: result of choose_under().
Result<MeasurementEnd> finish(const report::Report& report, const Options& options,
                              const std::string& assets,
                              const std::vector<metrics::MetricLimit>& limits, bool met) {
    RETURN_IF_ERROR(experiment::write_report_files(report, assets));
    for (const auto& warning : report.warnings) log::warning(warning);
    for (const auto& note : report.notes) log::warning(note);
    for (const auto& variant : report.variants)
        if (!variant.failure.empty()) log::error(variant.name + ": " + variant.failure);
    if (!options.json) {
        if (report.comparison)
            for (const auto* line : {&report.comparison->verdict, &report.comparison->claims})
                if (!line->empty()) std::printf("%s\n", printable(*line).c_str());
        if (report.kind == report::Kind::bench) print_curve(report);
        for (const auto& line : report.under) std::printf("%s\n", printable(line).c_str());
        std::printf("%s\n", printable(experiment::page_path(report)).c_str());
    }
    MeasurementEnd end;
    end.exit_code = experiment::exit_code_of(report, limits, met, end.reasons);
    for (const auto& line : end.reasons) log::error(line);
    for (const auto& variant : report.variants)
        if (!variant.failure.empty()) end.reasons.push_back(variant.name + ": " + variant.failure);
    end.failed =
        std::ranges::none_of(report.variants, &std::string::empty, &report::Variant::failure);
    end.verdict = verdict_of(report);
    return end;
}

// "paper" of "config/chains/paper.yaml".
std::string chain_name(const std::string& path) {
    return std::filesystem::path(path).stem().string();
}

Result<MeasurementEnd> ab_subcommand(const Options& options, const ExperimentOptions& e) {
    ASSIGN_OR_RETURN(auto a, load_chain_of(options));
    Options of_b = options;
    of_b.chain = e.chain_b;
    ASSIGN_OR_RETURN(auto b, load_chain_of(of_b));
    experiment::ExperimentSettings settings = e.ab;
    const std::vector<std::string> chains = {options.chain, e.chain_b};
    ASSIGN_OR_RETURN(auto run, run_settings_of(options));
    complete(settings, std::move(run), options, chains, {a.chain.camera, b.chain.camera});
    ASSIGN_OR_RETURN(auto limits, experiment::limits_of("fail_above", e.fail_above,
                                                        report::Kind::ab, !settings.truth.empty()));
    const StopOnSignal stop;
    ASSIGN_OR_RETURN(auto context, context_of(options));
    settings.renderer = sequence::renderer_text(context->device());
    settings.software = context->device().software;
    Executor executor(context->device());
    const experiment::NamedChain first{chain_name(options.chain), std::move(a.chain)};
    const experiment::NamedChain second{chain_name(e.chain_b), std::move(b.chain)};
    auto report = experiment::run_ab(first, second, settings, executor,
                                     progress_printer(options.json), &stop.flag());
    log::progress("");
    if (stop.asked()) return interrupted(stop, "no report is written; run the same command again");
    if (!report.ok()) return report.status();
    return finish(*report, options, settings.assets, limits, true);
}

Result<MeasurementEnd> bench_subcommand(const Options& options, const ExperimentOptions& e) {
    // Loaded once separately for its own notes and errors.
    RETURN_IF_ERROR(load_chain_of(options).status());
    ASSIGN_OR_RETURN(auto variants, variants_of(options, e));
    experiment::BenchSettings settings = e.bench;
    std::vector<Camera> cameras;
    for (const auto& variant : variants) cameras.push_back(variant.chain.camera);
    ASSIGN_OR_RETURN(auto run, run_settings_of(options));
    complete(settings, std::move(run), options, {options.chain}, cameras);
    settings.chain_name = chain_name(options.chain);
    ASSIGN_OR_RETURN(auto limits,
                     experiment::limits_of("fail_above", e.fail_above, report::Kind::bench, true));
    ASSIGN_OR_RETURN(auto under,
                     experiment::limits_of("under", e.under, report::Kind::bench, true));
    ASSIGN_OR_RETURN(const auto files, experiment::prepare_folder(settings));

    const StopOnSignal stop;
    ASSIGN_OR_RETURN(auto device, choose_device(options));
    const auto progress = progress_printer(options.json);
    const Status found =
        experiment::find_truth(settings, files, device, [&](const std::string& text) {
            progress({.what = text});
            return !stop.asked();
        });
    log::progress("");
    if (!found.ok() && stop.asked())
        return interrupted(stop, "nothing is measured yet; run the same command again");
    RETURN_IF_ERROR(found);
    ASSIGN_OR_RETURN(auto context, egl::Context::create(device));
    settings.renderer = sequence::renderer_text(context->device());
    settings.software = context->device().software;
    Executor executor(context->device());
    auto report =
        experiment::run_bench(variants, settings, files, executor, progress, &stop.flag());
    log::progress("");
    if (stop.asked())
        return interrupted(stop, "the same command continues with what is not measured yet");
    if (!report.ok()) return report.status();
    ASSIGN_OR_RETURN(auto met, experiment::choose_under(*report, under));
    return finish(*report, options, settings.assets, limits, met);
}

}  // namespace

MeasurementEnd interrupted(const StopOnSignal& stop, const std::string& how_to_go_on) {
    MeasurementEnd end;
    end.exit_code = stop.interrupted(how_to_go_on);
    end.interrupted = true;
    return end;
}

Result<int> end_of(const Result<MeasurementEnd>& end, bool json) {
    const MeasurementEnd ended =
        end.ok() ? *end
                 : MeasurementEnd{exit_code(end.status()), "", {end.status().message()}, true};
    if (json && !ended.interrupted)
        print_line({{"verdict", ended.verdict},
                    {"message", joined(ended.reasons, "; ")},
                    {"exit_code", ended.exit_code},
                    {"failed", ended.failed}});
    if (!end.ok()) return end.status();
    return ended.exit_code;
}

experiment::ProgressCallback progress_printer(bool json) {
    using Clock = std::chrono::steady_clock;
    std::optional<Clock::time_point> said;
    return [printed = size_t(0), json,
            said](const experiment::ExperimentProgress& progress) mutable {
        if (const auto now = Clock::now();
            json && (!said || now - *said >= std::chrono::seconds(1) ||
                     (progress.done > printed && progress.done == progress.total))) {
            print_line({{"what", progress.what},
                        {"done", progress.done},
                        {"total", progress.total},
                        {"remaining_s", progress.remaining_s}});
            said = now;
        }
        std::string text = progress.total
                               ? concat(progress.done, "/", progress.total, ", ", progress.what,
                                        ", ", log::duration(progress.elapsed_s), " elapsed")
                               : progress.what;
        if (progress.remaining_s > 0) text += ", " + log::duration(progress.remaining_s) + " to go";
        log::progress(progress.total ? double(progress.done) / double(progress.total) : 0, text);
        if (!log::progress_is_shown() && progress.done > printed) log::info(text);
        printed = progress.done;
    };
}

RunSubcommand add_ab(CLI::App& subcommand, Options& o) {
    const auto e = std::make_shared<ExperimentOptions>();
    add_chain_file(subcommand, "CHAIN_A", "chain", o.chain);
    add_chain_file(subcommand, "CHAIN_B", "chain_b", e->chain_b);
    add_relative_to(subcommand, o);
    add_experiment(subcommand, o, *e, experiment::ab_parameters(), &e->ab, {"chain", "chain_b"});
    return [&o, e] {
        if (o.check) return Result<int>(check_ab(o, *e));
        return end_of(ab_subcommand(o, *e), o.json);
    };
}

RunSubcommand add_bench(CLI::App& subcommand, Options& o) {
    const auto e = std::make_shared<ExperimentOptions>();
    add_chain_file(subcommand, "CHAIN", "chain", o.chain);
    add_relative_to(subcommand, o);
    add_list(subcommand, "--sweep", "KEY=V1,V2,...", e->sweeps,
             "values to try for one key of --set, may be repeated (all combinations are "
             "run): motion_blur.samples=5,9,13");
    add_list(subcommand, "--under", "METRIC=NUMBER", e->under,
             "pick the cheapest variant whose mean does not exceed it and write its chain "
             "file, may be repeated: flip=0.1");
    add_experiment(subcommand, o, *e, experiment::bench_parameters(), &e->bench, {"chain"});
    return [&o, e] {
        if (o.check) return Result<int>(check_bench(o, *e));
        return end_of(bench_subcommand(o, *e), o.json);
    };
}

}  // namespace postchain
