#include "tools/service/work/experiment_work.h"

#include <algorithm>
#include <filesystem>

#include "tools/measure/experiment/experiment_input.h"
#include "tools/measure/experiment/outcome.h"
#include "tools/measure/experiment/report_folder.h"
#include "tools/measure/experiment/run_experiment.h"
#include "tools/measure/study/study_report.h"
#include "tools/measure/study/work.h"
#include "tools/sequence/record/frame_report.h"

namespace postchain::service {
namespace {

namespace fs = std::filesystem;

// Checks that every path of an experiment is under the roots, with links resolved. Errors (input),
// (output).
Status check_paths(const experiment::ExperimentSettings& settings, const Roots& roots) {
    RETURN_IF_ERROR(check_inputs(settings.run.input, roots));
    if (!settings.truth.empty()) {
        ASSIGN_OR_RETURN(auto truth, io::InputSpec::parse(settings.truth));
        RETURN_IF_ERROR(check_inputs(truth, roots));
    }
    if (!settings.assets.empty()) RETURN_IF_ERROR(check_folder(settings.assets, roots));
    // The camera file beside a generated scene is read to find its truth.
    const std::string beside = settings.run.input.color().folder() + "/camera.json";
    auto camera = load_camera(beside);
    if (camera.ok() && camera->camera.aperture_image &&
        !roots.resolve(camera->camera.aperture_image.file()).ok())
        return Status(StatusCode::input,
                      beside + ": names an aperture image outside the folders of this service");
    return check_folder(settings.folder, roots);
}

// The folder's files are this job's own after its first start.
class ExperimentWork {
  public:
    ExperimentWork(const Job& job, JobRequest& request, const WorkContext& context)
        : id_(job.id),
          request_(request),
          context_(context),
          roots_(context.reader.roots()),
          events_(context, job.id) {}

    WorkEnd work() {
        const auto end = measured();
        if (end.ok()) return *end;
        if (context_.stop) return stopped();
        return end.status().code() == StatusCode::gl
                   ? WorkEnd::of(WorkEnd::How::gl_failed, end.status().message())
                   : WorkEnd::failed(end.status());
    }

  private:
    static WorkEnd stopped() { return WorkEnd::of(WorkEnd::How::stopped, ""); }
    static WorkEnd store_failed(const Status& status) {
        return WorkEnd::of(WorkEnd::How::store_failed, status.message());
    }

    Result<WorkEnd> measured() {
        const bool is_study = request_.kind == JobKind::study;
        RETURN_IF_ERROR(check_experiment_paths(request_, roots_));
        if (context_.lost) return stopped();
        const auto begun = context_.store.has_begun(id_);
        if (!begun.ok()) return store_failed(begun.status());
        return is_study ? work_on_tasks(*begun) : ab_or_bench(*begun);
    }

    experiment::ProgressCallback progress() {
        return [this](const experiment::ExperimentProgress& progress) {
            if (!events_.say(progress.what, progress.done, progress.total)) return;
            context_.remaining(progress.remaining_s);
            context_.between();
        };
    }

    // --------------------------------------------------------------------------- ab, bench
    // ab replaces the files of an earlier start, bench resumes from them.
    Result<WorkEnd> ab_or_bench(bool begun) {
        experiment::ExperimentSettings& settings = request_.measured;
        const bool is_ab = request_.kind == JobKind::ab;
        const auto later = is_ab ? io::OnExisting::overwrite : io::OnExisting::skip;
        settings.renderer = context_.gl.renderer();
        settings.software = context_.gl.software();
        if (begun) settings.on_existing = later;
        ASSIGN_OR_RETURN(const auto files, experiment::prepare_folder(settings));
        if (Status status = context_.store.began(id_); !status.ok()) return store_failed(status);
        settings.on_existing = later;
        bool met = true;
        context_.progress.does("the first measurement did not end");
        auto report = is_ab ? experiment::run_ab(request_.chain, request_.chain_b, settings,
                                                 context_.gl.executor(), progress(), &context_.stop)
                            : bench(files, met);
        if (context_.lost) return stopped();
        context_.progress.does("the report was not written");
        RETURN_IF_ERROR(report.status());
        if (context_.stop) return stopped();
        RETURN_IF_ERROR(experiment::write_report_files(*report, settings.assets));
        return end_of(*report, met);
    }

    Result<report::Report> bench(const io::OutputFiles& files, bool& met) {
        const Status found = experiment::find_truth(
            request_.measured, files, context_.device,
            [&](const std::string& what) { return events_.say(what, 0, 0); });
        RETURN_IF_ERROR(context_.gl.make_current());
        if (!found.ok()) return found;
        auto report = experiment::run_bench(request_.variants, request_.measured, files,
                                            context_.gl.executor(), progress(), &context_.stop);
        if (!report.ok()) return report;
        ASSIGN_OR_RETURN(met, experiment::choose_under(*report, request_.under));
        return report;
    }

    WorkEnd end_of(const report::Report& report, bool met) const {
        WorkEnd end;
        std::vector<std::string> lines;
        end.exit_code = experiment::exit_code_of(report, request_.fail_above, met, lines);
        for (const auto& variant : report.variants)
            if (!variant.failure.empty()) lines.push_back(variant.name + ": " + variant.failure);
        for (const std::string& line : lines) end.say(line);
        // Every chain missed frames, as a run does whose frames are quarantined.
        if (std::ranges::none_of(report.variants, &std::string::empty, &report::Variant::failure))
            end.state = JobState::failed;
        if (report.comparison) {
            end.verdict = report.comparison->verdict;
        } else {
            const auto best = std::ranges::count(report.variants, true, &report::Variant::pareto);
            end.verdict = concat(report.variants.size(), " variants, ", best, " in the Pareto set");
            for (const std::string& line : report.under) end.verdict += "; " + line;
        }
        std::ranges::replace(end.verdict, '\n', ' ');
        return end;
    }

    // ------------------------------------------------------------------------------- study
    // Other processes may work on the tasks of the same folder.
    Result<WorkEnd> work_on_tasks(bool begun) {
        const study::StudySettings& settings = request_.study_settings;
        ASSIGN_OR_RETURN(
            const auto folder,
            study::StudyFolder::open(request_.study, settings.folder,
                                     begun ? io::OnExisting::skip : settings.on_existing));
        if (Status status = context_.store.began(id_); !status.ok()) return store_failed(status);
        const study::Machine machine{context_.gl.executor(),
                                     context_.gl.renderer(),
                                     context_.gl.software(),
                                     [this] { return context_.gl.make_current(); },
                                     context_.device,
                                     0,
                                     {"postchain", "serve", "study"}};
        context_.progress.does("the first measurement did not end");
        const auto done =
            study::work_on_tasks(request_.study, folder, {}, machine, progress(), &context_.stop);
        if (context_.stop) return stopped();
        RETURN_IF_ERROR(done.status());
        WorkEnd end;
        if (!done->complete()) {
            // Commands may work in the same folder. The process with the last result writes the
            // report.
            end.verdict =
                concat(done->results, " of ", done->tasks,
                       " results are done; another process makes the others and the report");
            return end;
        }
        ASSIGN_OR_RETURN(auto report, study::read_report(request_.study, folder));
        for (study::SceneEntry& scene : report.scenes) {
            if (scene.failure.empty()) continue;
            scene.failure = roots_.shown_in(scene.failure);
            end.exit_code = kExitSomeFailed;
            end.say(concat("scene ", scene.name, ": ", scene.failure));
        }
        RETURN_IF_ERROR(study::write_report(report, folder));
        end.verdict = joined(report.verdict(), " ");
        return end;
    }

    const std::string id_;
    JobRequest& request_;
    const WorkContext& context_;
    const Roots& roots_;
    ProgressEvents events_;
};

}  // namespace

int64_t bytes_of_files(const std::string& folder) {
    int64_t sum = 0;
    std::error_code error;
    for (fs::recursive_directory_iterator at(folder, error), end; !error && at != end;
         at.increment(error)) {
        std::error_code of_file;
        if (!at->is_regular_file(of_file) || at->is_symlink(of_file)) continue;
        if (const auto bytes = at->file_size(of_file); !of_file) sum += int64_t(bytes);
    }
    return sum;
}

Status check_experiment_paths(const JobRequest& request, const Roots& roots) {
    if (request.kind != JobKind::study) return check_paths(request.measured, roots);
    for (const study::Scene& scene : request.study.scenes) {
        experiment::ExperimentSettings measured = scene.measured;
        measured.folder = request.study_settings.folder;
        if (Status status = check_paths(measured, roots); !status.ok())
            return status.at("scene " + scene.name);
    }
    return Status();
}

WorkEnd work_on_experiment(const Job& job, JobRequest& request, const WorkContext& context) {
    return ExperimentWork(job, request, context).work();
}

}  // namespace postchain::service
