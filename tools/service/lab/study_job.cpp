#include "tools/service/lab/study_job.h"

#include <algorithm>
#include <filesystem>
#include <set>

#include "chain/base/text.h"
#include "config/text_tree.h"
#include "tools/measure/study/study_folder.h"
#include "tools/measure/study/study_report.h"
#include "tools/measure/study/work.h"
#include "tools/sequence/record/frame_report.h"
#include "tools/service/lab/measurement.h"
#include "tools/service/work/job_request.h"

namespace postchain::service {
namespace {

namespace fs = std::filesystem;

// `refused` counts the paths outside the roots.
study::StudyPaths paths_from(const fs::path& folder, const Roots& roots, size_t& refused) {
    return {[folder, &roots, &refused](const std::string& path) {
                auto resolved = roots.resolve((folder / path).string());
                refused += resolved.status().code() == StatusCode::input;
                return resolved;
            },
            [folder, &roots, &refused](const io::PathPattern& pattern) -> Result<io::PathPattern> {
                auto whole = io::PathPattern::parse((folder / pattern.text()).string());
                if (!whole.ok()) return whole;
                auto resolved = resolve_pattern(*whole, roots);
                refused += resolved.status().code() == StatusCode::input;
                return resolved;
            }};
}

}  // namespace

// A file, whose paths are relative to its folder, or an object, whose paths are relative to the
// first root.
StudyJob::StudyJob(const MeasurementText& request) {
    const auto& [body, roots, registry, version, threads, chains, chain, job] = request;
    body.read_rows(study::study_parameters(), "", &settings_);
    body.confine_rows(study::study_parameters(), &settings_);
    const TextNode* node = body.find("study");
    if (!node) {
        body.fault("study", "missing; give a study's file or object");
        return;
    }
    std::string file = joined_path(roots.folders().front(), kBodyFile), text;
    if (is_string(*node) && !RequestBody::has_zero(node->text)) {
        auto confined = body.confine("study", node->text);
        if (!confined) return;
        file = file_ = std::move(*confined);
        auto read = read_text_file(file, StatusCode::usage);
        if (!read.ok()) {
            body.fault("study", read.status().message());
            return;
        }
        text = std::move(*read);
    } else if (!node->is_map()) {
        body.fault("study", node->describe() + " is not a study's file or object");
        return;
    }
    size_t refused = 0;
    const study::StudyPaths paths = paths_from(fs::path(file).parent_path(), roots, refused);
    study::StudyFile read = node->is_map()
                                ? study::read_study(*node, file, registry, paths, version)
                                : study::read_study(text, file, registry, paths, version);
    for (Diagnostic& one : read.diagnostics) {
        if (one.file == file && node->is_map()) one.file = kBodyFile;
        const bool is_refused = one.severity == Severity::error && refused > 0;
        if (is_refused) --refused;
        body.add(std::move(one), is_refused);
    }
    study_ = std::move(read.study);
    for (study::Scene& scene : study_.scenes)
        scene.measured.run.source.layers.manifest_check = roots.resolver();
}

int StudyJob::frames() const {
    std::vector<int> of_scenes;
    for (const study::Scene& scene : study_.scenes)
        of_scenes.push_back(frames_of(scene.measured.run));
    int frames = 0;
    for (const study::Task& task : study::tasks_of(study_)) frames += of_scenes[task.scene];
    return frames;
}

Status StudyJob::check_scenes(const Roots& roots) const {
    for (const study::Scene& scene : study_.scenes) {
        experiment::ExperimentSettings measured = scene.measured;
        measured.folder = settings_.folder;
        if (Status status = check_paths(measured, roots); !status.ok())
            return status.at("scene " + scene.name);
    }
    return Status();
}

void StudyJob::limit_memory(uint64_t most) {
    for (study::Scene& scene : study_.scenes)
        service::limit_memory(scene.measured.run.source.max_memory, most);
}

std::string StudyJob::fault_of_queue() const {
    return file_.empty() ? "this service hands its jobs to another queue, whose tasks read a "
                           "study's file: name one"
                         : "";
}

WorkEnd StudyJob::work(const Job& job, const WorkContext& context) {
    MeasurementRun run(job, context);
    return run.end(work_on_tasks(run, context));
}

// Other processes may work on the tasks of the same folder.
Result<WorkEnd> StudyJob::work_on_tasks(MeasurementRun& run, const WorkContext& context) {
    const Roots& roots = context.reader.roots();
    RETURN_IF_ERROR(check_scenes(roots));
    if (context.lost) return MeasurementRun::stopped();
    const auto begun = context.store.has_begun(run.id());
    if (!begun.ok()) return MeasurementRun::store_failed(begun.status());
    ASSIGN_OR_RETURN(const auto folder, study::StudyFolder::open(
                                            study_, settings_.folder,
                                            *begun ? io::OnExisting::skip : settings_.on_existing));
    if (Status status = context.store.began(run.id()); !status.ok())
        return MeasurementRun::store_failed(status);
    const study::Machine machine{context.gl.executor(),
                                 context.gl.renderer(),
                                 context.gl.software(),
                                 [&context] { return context.gl.make_current(); },
                                 context.device,
                                 0,
                                 {"postchain", "serve", "study"}};
    context.progress.does("the first measurement did not end");
    const auto done =
        study::work_on_tasks(study_, folder, {}, machine, run.progress(), &context.stop);
    if (context.stop) return MeasurementRun::stopped();
    RETURN_IF_ERROR(done.status());
    WorkEnd end;
    if (!done->complete()) {
        // Commands may work in the same folder. The process with the last result writes the
        // report.
        end.verdict = concat(done->results, " of ", done->tasks,
                             " results are done; another process makes the others and the report");
        return end;
    }
    ASSIGN_OR_RETURN(auto report, study::read_report(study_, folder));
    for (study::SceneEntry& scene : report.scenes) {
        if (scene.failure.empty()) continue;
        scene.failure = roots.shown_in(scene.failure);
        end.exit_code = kExitSomeFailed;
        end.say(concat("scene ", scene.name, ": ", scene.failure));
    }
    RETURN_IF_ERROR(study::write_report(report, folder));
    end.verdict = joined(report.verdict(), " ");
    return end;
}

Status StudyJob::begin(const Roots& roots) {
    RETURN_IF_ERROR(check_scenes(roots));
    return study::StudyFolder::open(study_, settings_.folder, settings_.on_existing).status();
}

Result<TaskCommand> StudyJob::tasks(const Job& job, const RemoteSettings& settings, const Roots&,
                                    const std::string&) {
    TaskCommand tasks;
    // The folder was checked before the first task, which may run again.
    tasks.command = {settings.program,
                     name_of(job.kind),
                     file_,
                     "--output=" + settings_.folder,
                     "--on-existing=skip",
                     "--device=" + settings.device};
    const size_t count = std::min(study::tasks_of(study_).size(), kMostTasks);
    for (size_t i = 1; i <= count; ++i) tasks.words.push_back({concat("--chunk=", i, "/", count)});
    return tasks;
}

std::optional<TaskProgress> StudyJob::progress(const std::string&) const {
    // Reading the folder makes NFS look for new files.
    std::set<std::string> names;
    std::error_code error;
    for (fs::directory_iterator at(settings_.folder + "/tasks", error), end; !error && at != end;
         at.increment(error))
        names.insert(at->path().filename());
    TaskProgress progress;
    for (const study::Task& task : study::tasks_of(study_)) {
        ++progress.total;
        if (!names.contains(fs::path(study::result_path(task)).filename())) continue;
        ++progress.done;
        progress.what = task.name + ": measured";
    }
    return progress.done > 0 ? std::optional(progress) : std::nullopt;
}

std::optional<WorkEnd> StudyJob::end(const Job& job, int exit_code, const Roots& roots) const {
    if (!report_of(settings_.folder, job)) return std::nullopt;
    WorkEnd end;
    end.exit_code = exit_code;
    const auto folder = study::StudyFolder::open(study_, settings_.folder, io::OnExisting::skip);
    if (!folder.ok()) return WorkEnd::failed(folder.status());
    const auto report = study::read_report(study_, *folder);
    if (!report.ok()) return std::nullopt;
    for (const study::SceneEntry& scene : report->scenes)
        if (!scene.failure.empty())
            end.say(concat("scene ", scene.name, ": ", roots.shown_in(scene.failure)));
    end.verdict = joined(report->verdict(), " ");
    return end;
}

}  // namespace postchain::service
