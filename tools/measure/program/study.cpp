// postchain study: ab or bench over several scenes, with messages, progress and signals.
#include "tools/measure/program/subcommands.h"

#include <CLI/CLI.hpp>
#include <cstdio>

#include "chain/base/printable.h"
#include "config/text_tree.h"
#include "passes/registry.h"
#include "tools/apps/common/log.h"
#include "tools/apps/common/stop_on_signal.h"
#include "tools/measure/study/study.h"
#include "tools/measure/study/study_reader.h"
#include "tools/measure/study/study_report.h"
#include "tools/measure/study/work.h"
#include "tools/sequence/run/device.h"

namespace postchain {
namespace {

struct StudyOptions {
    std::string file;
    study::StudySettings settings;
};

Result<study::Study> study_of(const std::string& path) {
    ASSIGN_OR_RETURN(const auto text, read_text_file(path, StatusCode::usage));
    auto file =
        study::read_study(text, path, builtin_passes(), study::paths_beside(path), kVersion);
    RETURN_IF_ERROR(log::write(file.diagnostics, log::Level::detail));
    return std::move(file.study);
}

Result<MeasurementEnd> finish(const study::Study& study, const study::StudyFolder& folder,
                              bool json) {
    ASSIGN_OR_RETURN(const auto report, study::read_report(study, folder));
    RETURN_IF_ERROR(study::write_report(report, folder));
    MeasurementEnd end{report.failures() ? kExitSomeFailed : kExitOk,
                       joined(report.verdict(), " ")};
    for (const auto& scene : report.scenes)
        if (!scene.failure.empty())
            end.reasons.push_back("scene " + scene.name + ": " + scene.failure);
    for (const auto& reason : end.reasons) log::error(reason);
    if (json) return end;
    for (const auto& line : report.verdict()) std::printf("%s\n", printable(line).c_str());
    std::printf("%s\n", printable(folder.path() + "/index.html").c_str());
    return end;
}

Result<MeasurementEnd> study_subcommand(const Options& options, const StudyOptions& s) {
    io::Chunk chunk;
    if (!s.settings.chunk.empty()) {
        ASSIGN_OR_RETURN(chunk, io::Chunk::parse(s.settings.chunk).at("--chunk"));
    }
    ASSIGN_OR_RETURN(auto study, study_of(s.file));
    ASSIGN_OR_RETURN(auto folder,
                     study::StudyFolder::open(study, s.settings.folder, s.settings.on_existing));

    const StopOnSignal stop;
    ASSIGN_OR_RETURN(auto device, choose_device(options));
    ASSIGN_OR_RETURN(auto context, egl::Context::create(device));
    Executor executor(context->device());
    const study::Machine machine{executor,
                                 sequence::renderer_text(context->device()),
                                 context->device().software,
                                 [&] { return context->make_current(); },
                                 device,
                                 options.threads,
                                 options.command_line};
    auto done = study::work_on_tasks(study, folder, chunk, machine, progress_printer(options.json),
                                     &stop.flag());
    log::progress("");
    if (stop.asked())
        return interrupted(stop, "the same command continues with what is not measured yet");
    if (!done.ok()) return done.status();
    if (done->complete()) return finish(study, folder, options.json);
    MeasurementEnd end;
    end.verdict =
        concat(done->results, " of ", done->tasks,
               " results are complete; the process that makes the last one writes the report");
    log::info(end.verdict);
    return end;
}

}  // namespace

RunSubcommand add_study(CLI::App& subcommand, Options& o) {
    const auto s = std::make_shared<StudyOptions>();
    subcommand.add_option("STUDY", s->file, "study file, YAML or JSON")->required();
    add_settings(subcommand, study::study_parameters(), "", &s->settings);
    add_settings(subcommand, study::study_parameters(), study::kSplitGroup, &s->settings);
    add_device(subcommand, o);
    subcommand.add_flag("--json", o.json, kJsonHelp);
    add_progress(subcommand, o);
    add_confine(subcommand, o);
    return [&o, s] { return end_of(study_subcommand(o, *s), o.json); };
}

}  // namespace postchain
