#include "tools/measure/study/work.h"

#include <set>

#include "tools/measure/experiment/experiment_input.h"
#include "tools/measure/experiment/report_folder.h"
#include "tools/measure/experiment/run_experiment.h"
#include "tools/measure/study/revision.h"
#include "tools/sequence/files/atomic_file.h"

namespace postchain::study {
namespace {

void take(const report::Report& report, TaskResult& result) {
    result.truth = report.truth.value_or("");
    result.frames = report.frames;
    result.width = report.width;
    result.height = report.height;
    for (const auto& variant : report.variants) {
        if (!variant.failure.empty()) {
            result.failure = variant.name + ": " + variant.failure;
            result.variants.clear();
            return;
        }
        TaskResult::Figures figures{variant.name, {}, std::nullopt};
        if (variant.timing) figures.time_ms = variant.timing->total.median_ms;
        for (const auto& [metric, series] : variant.metrics)
            figures.metrics[metric] = series.frames;
        result.variants.push_back(std::move(figures));
    }
}

bool ends_the_study(const Status& status) {
    return status.code() == StatusCode::output || status.code() == StatusCode::gl ||
           status.code() == StatusCode::canceled || status.code() == StatusCode::internal;
}

Result<report::Report> measured(const Study& study, const Task& task,
                                experiment::BenchSettings& settings, const Machine& machine,
                                const experiment::ProgressCallback& progress,
                                const std::atomic<bool>* stop) {
    if (task.pair) {
        const auto both = chains_of(study, task);
        return experiment::run_ab(*both[0], *both[1], settings, machine.executor, progress, stop);
    }
    ASSIGN_OR_RETURN(const auto files, experiment::prepare_folder(settings));
    const Status found =
        experiment::find_truth(settings, files, machine.options, [&](const std::string& what) {
            if (progress) progress({what, 0, 0, 0, 0});
            return !(stop && *stop);
        });
    RETURN_IF_ERROR(machine.make_current());
    if (stop && *stop) return Status(StatusCode::canceled, "stopped");
    if (!found.ok()) return found;
    if (settings.truth.empty())
        return Status(StatusCode::input, "has no ground truth: " + settings.no_truth);
    return experiment::run_bench(study.chains, settings, files, machine.executor, progress, stop);
}

Result<TaskResult> measure_task(const Study& study, const Task& task, const std::string& folder,
                                const Machine& machine,
                                const experiment::ProgressCallback& progress,
                                const std::atomic<bool>* stop) {
    const Scene& scene = study.scenes[task.scene];
    TaskResult result;
    result.made_from = made_from(study, task);
    result.renderer = machine.renderer;
    result.revision = kSourceRevision;
    experiment::BenchSettings settings = scene.measured;
    settings.folder = folder + "/" + report_folder_of(study, task);
    settings.renderer = machine.renderer;
    settings.software = machine.software;
    settings.chain_name = study.chain_name;
    if (task.pair) {
        // An existing report belongs to this study, because the folder has the study's mark.
        settings.on_existing = io::OnExisting::overwrite;
        settings.resumes = false;
    }
    std::vector<Camera> cameras;
    for (const auto* one : chains_of(study, task)) cameras.push_back(one->chain.camera);
    experiment::complete(settings, {settings.run, scene.input, study.chain_files, cameras,
                                    machine.command, machine.threads});
    auto report = measured(study, task, settings, machine, progress, stop);
    if (stop && *stop) return Status(StatusCode::canceled, "stopped");
    if (report.ok()) {
        if (Status status = experiment::write_report_files(*report, {}); !status.ok())
            return status.at("scene " + scene.name);
        take(*report, result);
    } else if (ends_the_study(report.status())) {
        return report.status().at("scene " + scene.name);
    } else {
        result.failure = report.status().message();
    }
    return result;
}

// One task's part of the figures of all tasks.
experiment::ProgressCallback inside(const experiment::ProgressCallback& progress, const Task& task,
                                    size_t done, size_t total) {
    return [=](const experiment::ExperimentProgress& one) {
        experiment::ExperimentProgress all = one;
        all.what = concat(task.name, ": ", one.what,
                          one.total ? concat(" (", one.done, "/", one.total, ")") : "");
        all.done = done;
        all.total = total;
        all.remaining_s = 0;
        if (progress) progress(all);
    };
}

}  // namespace

Result<WorkDone> work_on_tasks(const Study& study, const StudyFolder& folder,
                               const io::Chunk& chunk, const Machine& machine,
                               const experiment::ProgressCallback& progress,
                               const std::atomic<bool>* stop) {
    const auto tasks = tasks_of(study);
    const auto [first, end] = chunk.of(tasks.size());
    std::set<size_t> failed_before;
    for (size_t i = first; i < end; ++i) {
        ASSIGN_OR_RETURN(auto result, folder.result(study, tasks[i]));
        if (result && !result->failure.empty()) failed_before.insert(i);
    }
    WorkDone work;
    work.tasks = tasks.size();
    for (bool again = true; again;) {
        again = false;
        size_t done = 0;
        for (size_t i = first; i < end; ++i, ++done) {
            if (stop && *stop) return Status(StatusCode::canceled, "stopped");
            ASSIGN_OR_RETURN(auto claim,
                             io::Claim::take(folder.path() + "/" + claim_path(tasks[i])));
            if (!claim) continue;
            // Another process has made it meanwhile.
            ASSIGN_OR_RETURN(auto result, folder.result(study, tasks[i]));
            if (result && !failed_before.contains(i)) {
                claim->finish();
                continue;
            }
            failed_before.erase(i);
            ASSIGN_OR_RETURN(auto made,
                             measure_task(study, tasks[i], folder.path(), machine,
                                          inside(progress, tasks[i], done, end - first), stop));
            RETURN_IF_ERROR(folder.keep(tasks[i], made));
            claim->finish();
            ++work.made;
            again = true;
        }
    }
    for (const Task& task : tasks) {
        ASSIGN_OR_RETURN(auto result, folder.result(study, task));
        work.results += result.has_value();
    }
    return work;
}

}  // namespace postchain::study
