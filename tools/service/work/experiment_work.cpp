#include "tools/service/work/experiment_work.h"

#include "tools/measure/experiment/experiment_input.h"
#include "tools/measure/experiment/outcome.h"
#include "tools/measure/experiment/report_folder.h"
#include "tools/measure/experiment/run_experiment.h"
#include "tools/measure/study/study_report.h"
#include "tools/measure/study/work.h"
#include "tools/sequence/record/frame_report.h"

namespace postchain::service {
namespace {

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

// ------------------------------------------------------------------------------------- ab, bench
class ExperimentWork {
  public:
    ExperimentWork(const Job& job, JobRequest& request, const WorkContext& context)
        : id_(job.id),
          request_(request),
          context_(context),
          roots_(context.reader.roots()),
          events_(context, job.id) {}

    WorkEnd work() {
        experiment::ExperimentSettings& settings =
            request_.kind == JobKind::ab ? request_.ab : request_.bench;
        settings.renderer = context_.gl.renderer();
        settings.software = context_.gl.software();
        if (Status status = check_paths(settings, roots_); !status.ok())
            return WorkEnd::failed(status);
        if (context_.lost) return WorkEnd::of(WorkEnd::How::stopped, "");
        const auto begun = context_.store.has_begun(id_);
        if (!begun.ok()) return WorkEnd::of(WorkEnd::How::store_failed, begun.status().message());
        // After its first start the folder's files are this job's own: ab replaces them, bench
        // resumes from them.
        const auto later =
            request_.kind == JobKind::ab ? io::OnExisting::overwrite : io::OnExisting::skip;
        if (*begun) settings.on_existing = later;
        auto files = experiment::prepare_folder(settings);
        if (!files.ok()) return WorkEnd::failed(files.status());
        if (Status status = context_.store.began(id_); !status.ok())
            return WorkEnd::of(WorkEnd::How::store_failed, status.message());
        settings.on_existing = later;
        bool met = true;
        context_.progress.does("the first measurement did not end");
        auto report = request_.kind == JobKind::ab ? ab() : bench(*files, met);
        if (context_.lost) return WorkEnd::of(WorkEnd::How::stopped, "");
        context_.progress.does("the report was not written");
        if (!report.ok()) return end_of(report.status());
        if (context_.stop) return WorkEnd::of(WorkEnd::How::stopped, "");
        if (Status status = experiment::write_report_files(*report, settings.assets); !status.ok())
            return WorkEnd::failed(status);
        return end_of(*report, met);
    }

  private:
    experiment::ProgressCallback progress() {
        return [this](const experiment::ExperimentProgress& progress) {
            if (!events_.say(progress.what, progress.done, progress.total)) return;
            context_.remaining(progress.remaining_s);
            context_.between();
        };
    }

    Result<report::Report> ab() {
        return experiment::run_ab(request_.chain, request_.chain_b, request_.ab,
                                  context_.gl.executor(), progress(), &context_.stop);
    }

    Result<report::Report> bench(const io::OutputFiles& files, bool& met) {
        const Status found = experiment::find_truth(
            request_.bench, files, context_.device,
            [&](const std::string& what) { return events_.say(what, 0, 0); });
        RETURN_IF_ERROR(context_.gl.make_current());
        if (!found.ok()) return found;
        auto report = experiment::run_bench(request_.variants, request_.bench, files,
                                            context_.gl.executor(), progress(), &context_.stop);
        if (!report.ok()) return report;
        ASSIGN_OR_RETURN(met, experiment::choose_under(*report, request_.under));
        return report;
    }

    WorkEnd end_of(const Status& status) const {
        if (context_.stop) return WorkEnd::of(WorkEnd::How::stopped, "");
        if (status.code() == StatusCode::gl)
            return WorkEnd::of(WorkEnd::How::gl_failed, status.message());
        return WorkEnd::failed(status);
    }

    WorkEnd end_of(const report::Report& report, bool met) const {
        WorkEnd end;
        std::vector<std::string> lines;
        end.exit_code = experiment::exit_code_of(report, request_.fail_above, met, lines);
        for (const auto& variant : report.variants)
            if (!variant.failure.empty()) lines.push_back(variant.name + ": " + variant.failure);
        for (const std::string& line : lines) end.say(line);
        if (report.comparison) {
            end.verdict = report.comparison->verdict;
        } else {
            size_t best = 0;
            for (const auto& variant : report.variants) best += variant.pareto;
            end.verdict = concat(report.variants.size(), " variants, ", best, " in the Pareto set");
            for (const std::string& line : report.under) end.verdict += "; " + line;
        }
        for (char& c : end.verdict)
            if (c == '\n') c = ' ';
        return end;
    }

    const std::string id_;
    JobRequest& request_;
    const WorkContext& context_;
    const Roots& roots_;
    ProgressEvents events_;
};

// ----------------------------------------------------------------------------------------- study
// Other processes may work on the tasks of the same folder.
class StudyWork {
  public:
    StudyWork(const Job& job, JobRequest& request, const WorkContext& context)
        : id_(job.id),
          study_(request.study),
          settings_(request.study_settings),
          context_(context),
          roots_(context.reader.roots()),
          events_(context, job.id) {}

    WorkEnd work() {
        if (Status status = check_paths(); !status.ok()) return WorkEnd::failed(status);
        if (context_.lost) return WorkEnd::of(WorkEnd::How::stopped, "");
        const auto begun = context_.store.has_begun(id_);
        if (!begun.ok()) return WorkEnd::of(WorkEnd::How::store_failed, begun.status().message());
        // After its first start the folder's results are this job's own.
        auto folder = study::StudyFolder::open(
            study_, settings_.folder, *begun ? io::OnExisting::skip : settings_.on_existing);
        if (!folder.ok()) return WorkEnd::failed(folder.status());
        if (Status status = context_.store.began(id_); !status.ok())
            return WorkEnd::of(WorkEnd::How::store_failed, status.message());
        const study::Machine machine{context_.gl.executor(),
                                     context_.gl.renderer(),
                                     context_.gl.software(),
                                     [this] { return context_.gl.make_current(); },
                                     context_.device,
                                     0,
                                     {"postchain", "serve", "study"}};
        context_.progress.does("the first measurement did not end");
        const auto done =
            study::work_on_tasks(study_, *folder, {}, machine, progress(), &context_.stop);
        if (context_.stop) return WorkEnd::of(WorkEnd::How::stopped, "");
        if (!done.ok())
            return done.status().code() == StatusCode::gl
                       ? WorkEnd::of(WorkEnd::How::gl_failed, done.status().message())
                       : WorkEnd::failed(done.status());
        return done->complete() ? report(*folder) : left_to_others(*done);
    }

  private:
    Status check_paths() const {
        for (const study::Scene& scene : study_.scenes) {
            experiment::ExperimentSettings measured = scene.measured;
            measured.folder = settings_.folder;
            if (Status status = service::check_paths(measured, roots_); !status.ok())
                return status.at("scene " + scene.name);
        }
        return Status();
    }

    experiment::ProgressCallback progress() {
        return [this](const experiment::ExperimentProgress& progress) {
            if (events_.say(progress.what, progress.done, progress.total)) context_.between();
        };
    }

    WorkEnd report(const study::StudyFolder& folder) const {
        auto report = study::read_report(study_, folder);
        if (!report.ok()) return WorkEnd::failed(report.status());
        WorkEnd end;
        for (study::SceneEntry& scene : report->scenes) {
            if (scene.failure.empty()) continue;
            scene.failure = roots_.shown_in(scene.failure);
            end.exit_code = kExitSomeFailed;
            end.say(concat("scene ", scene.name, ": ", scene.failure));
        }
        if (Status status = study::write_report(*report, folder); !status.ok())
            return WorkEnd::failed(status);
        end.verdict = joined(report->verdict(), " ");
        return end;
    }

    // Commands may work in the same folder. The process with the last result writes the report.
    static WorkEnd left_to_others(const study::WorkDone& done) {
        WorkEnd end;
        end.verdict = concat(done.results, " of ", done.tasks,
                             " results are done; another process makes the others and the report");
        return end;
    }

    const std::string id_;
    const study::Study& study_;
    const study::StudySettings& settings_;
    const WorkContext& context_;
    const Roots& roots_;
    ProgressEvents events_;
};

}  // namespace

WorkEnd work_on_experiment(const Job& job, JobRequest& request, const WorkContext& context) {
    return ExperimentWork(job, request, context).work();
}

WorkEnd work_on_study(const Job& job, JobRequest& request, const WorkContext& context) {
    return StudyWork(job, request, context).work();
}

}  // namespace postchain::service
