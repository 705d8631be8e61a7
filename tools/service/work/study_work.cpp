#include "tools/service/work/study_work.h"

#include "tools/measure/study/study_report.h"
#include "tools/measure/study/work.h"
#include "tools/sequence/record/frame_report.h"
#include "tools/service/work/experiment_work.h"

namespace postchain::service {
namespace {

class StudyWork {
  public:
    StudyWork(const Job& job, JobRequest& request, const WorkPlace& place)
        : id_(job.id),
          study_(request.study),
          settings_(request.study_settings),
          place_(place),
          roots_(place.reader.roots()),
          events_(place, job.id) {}

    WorkEnd work() {
        if (Status status = check_paths(); !status.ok()) return WorkEnd::failed(status);
        if (place_.lost) return WorkEnd::of(WorkEnd::How::stopped, "");
        const auto begun = place_.store.has_begun(id_);
        if (!begun.ok()) return WorkEnd::of(WorkEnd::How::store_failed, begun.status().message());
        // After its first start the folder's results are this job's own.
        auto folder = study::StudyFolder::open(
            study_, settings_.folder, *begun ? io::OnExisting::skip : settings_.on_existing);
        if (!folder.ok()) return WorkEnd::failed(folder.status());
        if (Status status = place_.store.began(id_); !status.ok())
            return WorkEnd::of(WorkEnd::How::store_failed, status.message());
        const study::Machine machine{place_.gl.executor(),
                                     place_.gl.renderer(),
                                     place_.gl.software(),
                                     [this] { return place_.gl.make_current(); },
                                     place_.device,
                                     0,
                                     {"postchain", "serve", "study"}};
        place_.progress.does("the first measurement did not end");
        const auto done =
            study::work_on_tasks(study_, *folder, {}, machine, progress(), &place_.stop);
        if (place_.stop) return WorkEnd::of(WorkEnd::How::stopped, "");
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
            if (events_.say(progress.what, progress.done, progress.total)) place_.between();
        };
    }

    WorkEnd report(const study::StudyFolder& folder) const {
        auto report = study::read_report(study_, folder);
        if (!report.ok()) return WorkEnd::failed(report.status());
        WorkEnd end;
        for (study::SceneEntry& scene : report->scenes) {
            if (scene.failure.empty()) continue;
            scene.failure = roots_.shown_in(scene.failure);
            end.exit_code = sequence::kExitSomeFailed;
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
    const WorkPlace& place_;
    const Roots& roots_;
    ProgressEvents events_;
};

}  // namespace

WorkEnd work_on_study(const Job& job, JobRequest& request, const WorkPlace& place) {
    return StudyWork(job, request, place).work();
}

}  // namespace postchain::service
