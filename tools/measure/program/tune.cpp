// postchain tune: messages, progress and the file of the tuned chain.
#include "tools/measure/program/subcommands.h"

#include <CLI/CLI.hpp>
#include <cstdio>
#include <fstream>
#include <sstream>

#include "chain/base/printable.h"
#include "tools/apps/common/log.h"
#include "tools/apps/common/stop_on_signal.h"
#include "tools/measure/tune/tune.h"
#include "tools/measure/tune/tune_text.h"
#include "tools/sequence/run/device.h"
#include "tools/sequence/run/run_files.h"

namespace postchain {
namespace {

struct TuneOptions {
    std::vector<std::string> chains;  // to start from; empty: shipped ones
    tune::TuneSettings settings;
};

// The chain file of a stopped walk, which this one goes on with.
std::optional<tune::StoppedWalk> stopped_walk(const tune::TuneSettings& settings) {
    if (settings.on_existing == io::OnExisting::overwrite) return std::nullopt;
    std::ifstream file(settings.folder, std::ios::binary);
    std::ostringstream text;
    text << file.rdbuf();
    return tune::stopped_walk_of(text.str());
}

Result<io::OutputFiles> files_of(const tune::TuneSettings& settings, bool continues) {
    io::OutputFiles files(continues ? io::OnExisting::overwrite : settings.on_existing);
    sequence::read_inputs(settings.run, files);
    if (!settings.truth.empty()) {
        ASSIGN_OR_RETURN(const auto truth, io::InputSpec::parse(settings.truth).at("--truth"));
        files.read(truth.color(), "the ground truth");
    }
    files.write(io::OutputFile{settings.folder, "the chain file", "name another with --output"});
    return files;
}

Result<int> tune_subcommand(const Options& options, const TuneOptions& t) {
    tune::TuneSettings settings = t.settings;
    RETURN_IF_ERROR(tune::goal_of(settings).status());
    const auto names = t.chains.empty() ? tune::default_starts(!settings.truth.empty()) : t.chains;
    std::vector<tune::Start> starts;
    std::vector<std::string> fixed;
    std::vector<Camera> cameras;
    for (const std::string& name : names) {
        Options of_chain = options;
        of_chain.chain = name;
        ASSIGN_OR_RETURN(auto file, load_chain_of(of_chain));
        for (auto& knob : tune::fixed_knobs(file.chain, options.sets))
            fixed.push_back(std::move(knob));
        cameras.push_back(file.chain.camera);
        starts.push_back({name, std::move(file.chain)});
    }
    ASSIGN_OR_RETURN(auto run, run_settings_of(options));
    experiment::complete(settings, {std::move(run), options.job.input, names, cameras,
                                    options.command_line, options.threads});
    const auto earlier = stopped_walk(settings);
    ASSIGN_OR_RETURN(const auto files, files_of(settings, earlier.has_value()));
    RETURN_IF_ERROR(files.check());
    RETURN_IF_ERROR(files.check_folders());
    files.remove_left_temporaries();

    const StopOnSignal stop;
    ASSIGN_OR_RETURN(auto context, context_of(options));
    settings.renderer = sequence::renderer_text(context->device());
    settings.software = context->device().software;
    Executor executor(context->device());
    auto tuning =
        tune::run_tune(std::move(starts), fixed, settings, executor, progress_printer(false),
                       &stop.flag(), earlier ? &*earlier : nullptr);
    log::progress("");
    if (stop.asked() && !tuning.ok())
        return stop.interrupted("no chain is written; run the same command again");
    if (!tuning.ok()) return tuning.status();
    if (tuning->search.stopped) {
        RETURN_IF_ERROR(files.put(settings.folder, tune::tuned_chain_file(*tuning)));
        return stop.interrupted(concat(settings.folder, " is the best of ",
                                       tuning->search.candidates.size(),
                                       " measured chains; the same command goes on"));
    }
    if (earlier)
        log::info(concat(earlier->by_hash.size(), " chains were measured before the stop"));
    for (const auto& line : tune::doubts_of(*tuning)) log::warning(line);
    if (!tuning->with_truth) log::info("reference: " + tuning->reference);
    if (tuning->chosen())
        RETURN_IF_ERROR(files.put(settings.folder, tune::tuned_chain_file(*tuning)));
    if (options.json)
        print_line(tune::tuning_json(*tuning));
    else
        print_text(tune::front_text(*tuning));
    if (!tuning->chosen()) {
        log::error(tune::outcome_text(*tuning) + "; nothing is written");
        return kExitThreshold;
    }
    log::info(tune::outcome_text(*tuning));
    if (!options.json) std::printf("%s\n", printable(settings.folder).c_str());
    return kExitOk;
}

}  // namespace

RunSubcommand add_tune(CLI::App& subcommand, Options& o) {
    const auto t = std::make_shared<TuneOptions>();
    subcommand.add_option("CHAIN", t->chains,
                          "chain files or names of shipped chains to start from (default: fast, "
                          "balanced and best; without --truth balanced, and only one)");
    add_list(subcommand, "--set", "KEY=VALUE", o.sets,
             "change a value of the chains, as in run; a value so set is not varied");
    add_settings(subcommand, job_parameters(), sequence::kInputGroup, &o.job);
    add_settings(subcommand, tune::tune_parameters(), "", &t->settings);
    add_settings(subcommand, job_parameters(), sequence::kPlanGroup, &o.job);
    add_device(subcommand, o);
    subcommand.add_flag("--json", o.json, "the measured chains as one JSON object on stdout");
    add_progress(subcommand, o);
    return [&o, t] { return tune_subcommand(o, *t); };
}

}  // namespace postchain
