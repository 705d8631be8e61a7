#include "tools/service/work/experiment_work.h"

#include "tools/measure/experiment/experiment_input.h"
#include "tools/measure/experiment/outcome.h"
#include "tools/measure/experiment/report_folder.h"
#include "tools/measure/experiment/run_experiment.h"

namespace postchain::service {
namespace {

class ExperimentWork {
  public:
    ExperimentWork(const Job& job, JobRequest& request, const WorkPlace& place)
        : id_(job.id),
          request_(request),
          place_(place),
          roots_(place.reader.roots()),
          events_(place, job.id) {}

    WorkEnd work() {
        experiment::ExperimentSettings& settings =
            request_.kind == JobKind::ab ? request_.ab : request_.bench;
        settings.renderer = place_.gl.renderer();
        settings.software = place_.gl.software();
        if (Status status = check_paths(settings, roots_); !status.ok())
            return WorkEnd::failed(status);
        if (place_.lost) return WorkEnd::of(WorkEnd::How::stopped, "");
        const auto begun = place_.store.has_begun(id_);
        if (!begun.ok()) return WorkEnd::of(WorkEnd::How::store_failed, begun.status().message());
        // After its first start the folder's files are this job's own: ab replaces them, bench
        // resumes from them.
        const auto later =
            request_.kind == JobKind::ab ? io::OnExisting::overwrite : io::OnExisting::skip;
        if (*begun) settings.on_existing = later;
        auto files = experiment::prepare_folder(settings);
        if (!files.ok()) return WorkEnd::failed(files.status());
        if (Status status = place_.store.began(id_); !status.ok())
            return WorkEnd::of(WorkEnd::How::store_failed, status.message());
        settings.on_existing = later;
        bool met = true;
        place_.progress.does("the first measurement did not end");
        auto report = request_.kind == JobKind::ab ? ab() : bench(*files, met);
        if (place_.lost) return WorkEnd::of(WorkEnd::How::stopped, "");
        place_.progress.does("the report was not written");
        if (!report.ok()) return end_of(report.status());
        if (place_.stop) return WorkEnd::of(WorkEnd::How::stopped, "");
        if (Status status = experiment::write_report_files(*report, settings.assets); !status.ok())
            return WorkEnd::failed(status);
        return end_of(*report, met);
    }

  private:
    experiment::ProgressCallback progress() {
        return [this](const experiment::ExperimentProgress& progress) {
            if (!events_.say(progress.what, progress.done, progress.total)) return;
            place_.remaining(progress.remaining_s);
            place_.between();
        };
    }

    Result<report::Report> ab() {
        return experiment::run_ab(request_.chain, request_.chain_b, request_.ab,
                                  place_.gl.executor(), progress(), &place_.stop);
    }

    Result<report::Report> bench(const io::OutputFiles& files, bool& met) {
        const Status found = experiment::find_truth(
            request_.bench, files, place_.device,
            [&](const std::string& what) { return events_.say(what, 0, 0); });
        RETURN_IF_ERROR(place_.gl.make_current());
        if (!found.ok()) return found;
        auto report = experiment::run_bench(request_.variants, request_.bench, files,
                                            place_.gl.executor(), progress(), &place_.stop);
        if (!report.ok()) return report;
        ASSIGN_OR_RETURN(met, experiment::choose_under(*report, request_.under));
        return report;
    }

    WorkEnd end_of(const Status& status) const {
        if (place_.stop) return WorkEnd::of(WorkEnd::How::stopped, "");
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
    const WorkPlace& place_;
    const Roots& roots_;
    ProgressEvents events_;
};

}  // namespace

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

WorkEnd work_on_experiment(const Job& job, JobRequest& request, const WorkPlace& place) {
    return ExperimentWork(job, request, place).work();
}

}  // namespace postchain::service
