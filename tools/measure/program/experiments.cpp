// postchain ab and bench: run experiments with messages, progress and signals.
#include "tools/measure/program/subcommands.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <filesystem>

#include "chain/base/printable.h"
#include "config/chain_find.h"
#include "passes/registry.h"
#include "tools/apps/common/log.h"
#include "tools/apps/common/stop_on_signal.h"
#include "tools/measure/experiment/experiment_input.h"
#include "tools/measure/experiment/outcome.h"
#include "tools/measure/experiment/report_folder.h"
#include "tools/measure/experiment/run_experiment.h"
#include "tools/measure/experiment/settings.h"
#include "tools/measure/experiment/sweep.h"
#include "tools/measure/report/report.h"
#include "tools/measure/report/report_json.h"
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
                    const ParameterTable& table, ParameterRef settings) {
    add_list(subcommand, "--set", "KEY=VALUE", o.sets, "change a value of the chain, as in run");
    add_settings(subcommand, job_parameters(), sequence::kInputGroup, &o.job);
    add_settings(subcommand, table, "", settings);
    add_list(subcommand, "--fail-above", "METRIC=NUMBER", e.fail_above,
             "exit with 8 if a variant's mean exceeds it, may be repeated: flip=0.05");
    add_settings(subcommand, job_parameters(), sequence::kPlanGroup, &o.job);
    add_device(subcommand, o);
    subcommand.add_flag("--json", o.json, "the report as one JSON object on stdout");
    add_progress(subcommand, o);
}

// Adds the settings outside the tables: those of the run and of this process.
Status complete(experiment::ExperimentSettings& settings, const Options& o,
                const std::vector<std::string>& chains, const std::vector<Camera>& cameras) {
    ASSIGN_OR_RETURN(auto run, run_settings_of(o));
    experiment::complete(settings,
                         {std::move(run), o.job.input, chains, cameras, o.command_line, o.threads});
    return Status();
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

// Writes the report's files and prints a summary; returns the exit code. `met`: result of
// choose_under().
Result<int> finish(const report::Report& report, const Options& options, const std::string& assets,
                   const std::vector<metrics::MetricLimit>& limits, bool met) {
    RETURN_IF_ERROR(experiment::write_report_files(report, assets));
    for (const auto& warning : report.warnings) log::warning(warning);
    for (const auto& note : report.notes) log::warning(note);
    for (const auto& variant : report.variants)
        if (!variant.failure.empty()) log::error(variant.name + ": " + variant.failure);
    if (options.json) {
        print_line(report::report_json(report));
    } else {
        if (report.comparison)
            for (const auto* line : {&report.comparison->verdict, &report.comparison->claims})
                if (!line->empty()) std::printf("%s\n", printable(*line).c_str());
        if (report.kind == report::Kind::bench) print_curve(report);
        for (const auto& line : report.under) std::printf("%s\n", printable(line).c_str());
        std::printf("%s\n", printable(experiment::page_path(report)).c_str());
    }
    std::vector<std::string> broken;
    const int code = experiment::exit_code_of(report, limits, met, broken);
    for (const auto& line : broken) log::error(line);
    return code;
}

// "paper" of "config/chains/paper.yaml".
std::string chain_name(const std::string& path) {
    return std::filesystem::path(path).stem().string();
}

Result<int> ab_subcommand(const Options& options, const ExperimentOptions& e) {
    ASSIGN_OR_RETURN(auto a, load_chain_of(options));
    Options of_b = options;
    of_b.chain = e.chain_b;
    ASSIGN_OR_RETURN(auto b, load_chain_of(of_b));
    experiment::ExperimentSettings settings = e.ab;
    const std::vector<std::string> chains = {options.chain, e.chain_b};
    RETURN_IF_ERROR(complete(settings, options, chains, {a.chain.camera, b.chain.camera}));
    ASSIGN_OR_RETURN(auto limits, experiment::limits_of("fail_above", e.fail_above,
                                                        report::Kind::ab, !settings.truth.empty()));
    const StopOnSignal stop;
    ASSIGN_OR_RETURN(auto context, context_of(options));
    settings.renderer = sequence::renderer_text(context->device());
    settings.software = context->device().software;
    Executor executor(context->device());
    const experiment::NamedChain first{chain_name(options.chain), std::move(a.chain)};
    const experiment::NamedChain second{chain_name(e.chain_b), std::move(b.chain)};
    auto report =
        experiment::run_ab(first, second, settings, executor, progress_printer(), &stop.flag());
    log::progress("");
    if (stop.asked()) return stop.interrupted("no report is written; run the same command again");
    if (!report.ok()) return report.status();
    return finish(*report, options, settings.assets, limits, true);
}

Result<int> bench_subcommand(const Options& options, const ExperimentOptions& e) {
    ASSIGN_OR_RETURN(auto chain, find_chain(options.chain));
    // Loaded once separately for its own notes and errors.
    RETURN_IF_ERROR(load_chain_of(options).status());
    std::vector<experiment::Sweep> sweeps;
    for (const auto& text : e.sweeps) {
        ASSIGN_OR_RETURN(auto sweep, experiment::parse_sweep(text));
        sweeps.push_back(std::move(sweep));
    }
    ASSIGN_OR_RETURN(auto variants,
                     experiment::sweep_variants(chain, builtin_passes(), options.sets, sweeps,
                                                e.bench.max_variants));
    experiment::BenchSettings settings = e.bench;
    std::vector<Camera> cameras;
    for (const auto& variant : variants) cameras.push_back(variant.chain.camera);
    RETURN_IF_ERROR(complete(settings, options, {options.chain}, cameras));
    settings.chain_name = chain_name(options.chain);
    ASSIGN_OR_RETURN(auto limits,
                     experiment::limits_of("fail_above", e.fail_above, report::Kind::bench, true));
    ASSIGN_OR_RETURN(auto under,
                     experiment::limits_of("under", e.under, report::Kind::bench, true));
    ASSIGN_OR_RETURN(const auto files, experiment::prepare_folder(settings));

    const StopOnSignal stop;
    ASSIGN_OR_RETURN(auto device, choose_device(options));
    const Status found =
        experiment::find_truth(settings, files, device, [&](const std::string& text) {
            log::progress(text);
            return !stop.asked();
        });
    log::progress("");
    if (!found.ok() && stop.asked())
        return stop.interrupted("nothing is measured yet; run the same command again");
    RETURN_IF_ERROR(found);
    ASSIGN_OR_RETURN(auto context, egl::Context::create(device));
    settings.renderer = sequence::renderer_text(context->device());
    settings.software = context->device().software;
    Executor executor(context->device());
    auto report = experiment::run_bench(variants, settings, files, executor, progress_printer(),
                                        &stop.flag());
    log::progress("");
    if (stop.asked())
        return stop.interrupted("the same command continues with what is not measured yet");
    if (!report.ok()) return report.status();
    ASSIGN_OR_RETURN(auto met, experiment::choose_under(*report, under));
    return finish(*report, options, settings.assets, limits, met);
}

}  // namespace

experiment::ProgressCallback progress_printer() {
    return [printed = size_t(0)](const experiment::ExperimentProgress& progress) mutable {
        std::string text = concat(progress.done, "/", progress.total, ", ", progress.what, ", ",
                                  log::duration(progress.elapsed_s), " elapsed");
        if (progress.remaining_s > 0) text += ", " + log::duration(progress.remaining_s) + " to go";
        log::progress(progress.total ? double(progress.done) / double(progress.total) : 0, text);
        if (!log::progress_is_shown() && progress.done > printed) log::info(text);
        printed = progress.done;
    };
}

RunSubcommand add_ab(CLI::App& subcommand, Options& o) {
    const auto e = std::make_shared<ExperimentOptions>();
    subcommand.add_option("CHAIN_A", o.chain, "chain file, or the name of a shipped chain")
        ->required();
    subcommand.add_option("CHAIN_B", e->chain_b, "the other chain")->required();
    add_experiment(subcommand, o, *e, experiment::ab_parameters(), &e->ab);
    return [&o, e] { return ab_subcommand(o, *e); };
}

RunSubcommand add_bench(CLI::App& subcommand, Options& o) {
    const auto e = std::make_shared<ExperimentOptions>();
    subcommand.add_option("CHAIN", o.chain, "chain file, or the name of a shipped chain")
        ->required();
    add_list(subcommand, "--sweep", "KEY=V1,V2,...", e->sweeps,
             "values to try for one key of --set, may be repeated (all combinations are "
             "run): motion_blur.samples=5,9,13");
    add_list(subcommand, "--under", "METRIC=NUMBER", e->under,
             "pick the cheapest variant whose mean does not exceed it and write its chain "
             "file, may be repeated: flip=0.1");
    add_experiment(subcommand, o, *e, experiment::bench_parameters(), &e->bench);
    return [&o, e] { return bench_subcommand(o, *e); };
}

}  // namespace postchain
