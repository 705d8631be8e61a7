// postchain ab and bench: experiments with messages, progress and signals around them.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "tools/postchain/exit_code.h"
#include "tools/postchain/log.h"
#include "tools/postchain/stop_on_signal.h"
#include "tools/postchain/verbs.h"
#include "tools/report/ab.h"
#include "tools/report/limits.h"
#include "tools/report/page/page.h"

namespace postchain {
namespace {

std::string duration(double seconds) {
    const long s = long(seconds + 0.5);
    char text[32];
    std::snprintf(text, sizeof(text), "%ld:%02ld", s / 60, s % 60);
    return text;
}

// In place on a terminal; else a line whenever a unit of work is done.
report::ProgressCallback progress_printer() {
    return [printed = size_t(0)](const report::ExperimentProgress& progress) mutable {
        std::string text = concat(progress.done, "/", progress.total, ", ", progress.what, ", ",
                                  duration(progress.elapsed_s), " elapsed");
        if (progress.remaining_s > 0) text += ", " + duration(progress.remaining_s) + " to go";
        if (log::progress_is_shown())
            log::progress(text);
        else if (progress.done > printed)
            log::info(text);
        printed = progress.done;
    };
}

void add_experiment(CLI::App& verb, Options& o, ExperimentOptions& e) {
    e.pixels_per_degree = metrics::kPixelsPerDegree;
    verb.add_option("--set", o.sets, "change a value of the chain, as of run")
        ->type_name("KEY=VALUE")
        ->expected(1)
        ->take_all();
    add_input(verb, o);
    verb.add_option("-r,--truth", e.truth, "frames to measure against: both.####.exr")
        ->type_name("TRUTH");
    verb.add_option("-o,--output", o.output, "folder of the report; made when it is not there")
        ->type_name("DIR")
        ->required();
    verb.add_flag("--overwrite", e.overwrite, "replace the report that lies there");
    verb.add_option("--repeats", e.repeats, "repetitions of each timing")
        ->check(CLI::Range(1, 10000))
        ->capture_default_str();
    verb.add_option("--page-frames", e.page_frames, "frames whose pictures are kept")
        ->check(CLI::Range(1, 1000));
    verb.add_option("--assets", e.assets,
                    "folder for the page's pictures, which are inside the page otherwise")
        ->type_name("DIR");
    verb.add_option("--fail-above", e.fail_above,
                    "exit with 8 when a variant's mean is above it, may be repeated: flip=0.05")
        ->type_name("METRIC=NUMBER")
        ->expected(1)
        ->take_all();
    verb.add_option("--ppd", e.pixels_per_degree, "pixels per degree of visual angle, for FLIP")
        ->check(CLI::Range(metrics::kMinPixelsPerDegree, metrics::kMaxPixelsPerDegree))
        ->capture_default_str();
    verb.add_option("--tone-mapper", e.tone_mapper, "of HDR-FLIP")
        ->check(CLI::IsMember({"aces", "reinhard", "hable"}))
        ->capture_default_str();
    add_plan(verb, o);
    add_device(verb, o);
    verb.add_flag("--json", o.json, "the report as one JSON object on stdout");
}

Result<report::ExperimentSettings> settings_of(const Options& o, const ExperimentOptions& e,
                                               int argc, char** argv, int page_frames) {
    report::ExperimentSettings settings;
    auto run = input_settings_of(o);
    if (!run.ok()) return run.status();
    settings.run = std::move(*run);
    settings.input = o.input;
    settings.truth = e.truth;
    settings.folder = o.output;
    settings.overwrite = e.overwrite;
    settings.command.assign(argv, argv + argc);
    settings.threads = threads_of(o);
    settings.repeats = e.repeats;
    settings.page_frames = e.page_frames > 0 ? e.page_frames : page_frames;
    settings.flip.pixels_per_degree = e.pixels_per_degree;
    settings.flip.threads = o.threads;
    for (const auto mapper :
         {metrics::ToneMapper::aces, metrics::ToneMapper::reinhard, metrics::ToneMapper::hable})
        if (e.tone_mapper == metrics::name_of(mapper)) settings.flip.tone_mapper = mapper;
    return settings;
}

Result<std::vector<report::MetricLimit>> limits_of(const std::string& option,
                                                   const std::vector<std::string>& texts,
                                                   bool with_truth) {
    std::vector<report::MetricLimit> limits;
    for (const auto& text : texts) {
        auto limit = report::parse_limit(option, text, report::metric_columns(with_truth));
        if (!limit.ok()) return limit.status();
        limits.push_back(std::move(*limit));
    }
    return limits;
}

// All files of the report, a summary on stdout, and the exit code.
int finish(const report::Report& report, const Options& options, const ExperimentOptions& e,
           const std::vector<report::MetricLimit>& limits) {
    Status status = report::write_report_json(report);
    if (status.ok()) status = report::write_report_csv(report);
    if (status.ok()) status = report::write_report_markdown(report);
    const std::string page = report.folder + "/index.html";
    if (status.ok()) status = report::write_page(report, page, {e.assets});
    if (!status.ok()) return fail(status);
    for (const auto& note : report.notes) log::warning(note);
    size_t failed = 0;
    for (const auto& variant : report.variants) {
        if (variant.failure.empty()) continue;
        ++failed;
        log::error(variant.name + ": " + variant.failure);
    }
    if (options.json) {
        std::fputs(report::report_as_json(report).c_str(), stdout);
    } else {
        if (report.comparison)
            std::printf("%s\n%s\n", report.comparison->verdict.c_str(),
                        report.comparison->claims.c_str());
        for (const auto& line : report.under) std::printf("%s\n", line.c_str());
        std::printf("%s\n", page.c_str());
    }
    const auto broken = report::exceeding(report, limits);
    for (const auto& line : broken) log::error(line);
    if (!broken.empty()) return kExitThreshold;
    return failed > 0 ? kExitSomeFailed : kExitOk;
}

// "paper" of "config/chains/paper.yaml".
std::string chain_name(const std::string& path) {
    return std::filesystem::path(path).stem().string();
}

}  // namespace

void add_ab(CLI::App& verb, Options& o, ExperimentOptions& e) {
    verb.add_option("CHAIN_A", o.chain, "chain file, or the name of a shipped chain")->required();
    verb.add_option("CHAIN_B", e.chain_b, "the other one")->required();
    add_experiment(verb, o, e);
}

int ab_verb(const Options& options, const ExperimentOptions& e, int argc, char** argv) {
    auto a = load_chain_of(options);
    if (!a.ok()) return fail(a.status());
    Options of_b = options;
    of_b.chain = e.chain_b;
    auto b = load_chain_of(of_b);
    if (!b.ok()) return fail(b.status());
    auto settings = settings_of(options, e, argc, argv, 8);
    if (!settings.ok()) return fail(settings.status());
    auto limits = limits_of("--fail-above", e.fail_above, !e.truth.empty());
    if (!limits.ok()) return fail(limits.status());
    const StopOnSignal stop;
    auto context = context_of(options);
    if (!context.ok()) return fail(context.status());
    settings->renderer = renderer_text(**context);
    settings->software = (*context)->software();
    Executor executor(**context);
    const report::NamedChain first{chain_name(options.chain), std::move(a->chain)};
    const report::NamedChain second{chain_name(e.chain_b), std::move(b->chain)};
    auto report =
        report::run_ab(first, second, *settings, executor, progress_printer(), &stop.flag());
    log::progress("");
    if (stop.asked()) return stop.exit_code();
    if (!report.ok()) return fail(report.status());
    return finish(*report, options, e, *limits);
}

}  // namespace postchain
