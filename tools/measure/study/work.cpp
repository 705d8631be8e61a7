#include "tools/measure/study/work.h"

#include <set>

#include "tools/sequence/files/atomic_file.h"

namespace postchain::study {
namespace {

// Figures of one task inside those of all.
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
