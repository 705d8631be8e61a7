// postchain study: ab or bench over several scenes, with messages, progress and signals.
#include "tools/measure/program/subcommands.h"

#include <CLI/CLI.hpp>
#include <cstdio>

#include "chain/base/printable.h"
#include "config/text_tree.h"
#include "passes/registry.h"
#include "tools/apps/common/checks.h"
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

Result<study::StudyFile> read_study_of(const StudyOptions& s, const std::string& relative_to) {
    ASSIGN_OR_RETURN(const auto text, read_text_file(s.file, StatusCode::usage));
    const std::string beside = relative_to.empty() ? s.file : relative_to + "/study.yaml";
    return study::read_study(text, s.file, builtin_passes(), study::paths_beside(beside), kVersion);
}

Result<study::Study> study_of(const StudyOptions& s, const std::string& relative_to) {
    ASSIGN_OR_RETURN(auto file, read_study_of(s, relative_to));
    RETURN_IF_ERROR(log::write(file.diagnostics, log::Level::detail));
    return std::move(file.study);
}

// The frames of a scene; 0 if it cannot be measured, which is a fault of this scene alone.
size_t frames_of(const study::Scene& scene) {
    const auto list = io::find_frames(scene.measured.run.input, scene.measured.run.frames);
    return list.ok() ? list->frames.size() : 0;
}

int check_study(const Options& options, const StudyOptions& s) {
    Checks checks;
    const auto& [folder, chunk, on_existing] = s.settings;
    if (!chunk.empty()) checks.take("chunk", io::Chunk::parse(chunk).status());
    const auto file = checks.take("study", read_study_of(s, options.relative_to));
    if (!file || !checks.take("study", file->diagnostics)) return checks.print({});
    const Status found = study::StudyFolder::check(file->study, folder, on_existing);
    checks.take(found.code() == StatusCode::usage ? "output" : "on_existing", found);
    if (!options.confine_to.empty()) {
        for (const study::Scene& scene : file->study.scenes) {
            checks.reads("study", scene.measured.run.input);
            if (const auto truth = io::InputSpec::parse(scene.measured.truth); truth.ok())
                checks.reads("study", *truth);
        }
        checks.writes("output", folder);
    }
    size_t frames = 0;
    for (const study::Task& task : study::tasks_of(file->study))
        frames += frames_of(file->study.scenes[task.scene]);
    return checks.print(
        {{"frames", frames}, {"writes", {whole_path(folder)}}, {"new_folder", false}});
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
    ASSIGN_OR_RETURN(auto study, study_of(s, options.relative_to));
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
    add_relative_to(subcommand, o);
    add_device(subcommand, o);
    subcommand.add_flag("--json", o.json, kJsonHelp);
    add_progress(subcommand, o);
    add_confine(subcommand, o);
    add_property(subcommand, "study",
                 {{"description", "a study file"}, {"type", "string"}, {"x-path", "file"}});
    add_checks(subcommand, o, {"study"});
    return [&o, s] {
        if (o.check) return Result<int>(check_study(o, *s));
        return end_of(study_subcommand(o, *s), o.json);
    };
}

}  // namespace postchain
