#include "tools/measure/study/work.h"

#include <set>

#include "tools/sequence/files/claim.h"

namespace postchain::study {
namespace {

// Figures of one unit inside those of all.
experiment::ProgressCallback inside(const experiment::ProgressCallback& progress, const Unit& unit,
                                    size_t done, size_t total) {
    return [=](const experiment::ExperimentProgress& one) {
        experiment::ExperimentProgress all = one;
        all.what = concat(unit.name, ": ", one.what,
                          one.total ? concat(" (", one.done, "/", one.total, ")") : "");
        all.done = done;
        all.total = total;
        all.remaining_s = 0;
        if (progress) progress(all);
    };
}

}  // namespace

Result<WorkDone> work_on_units(const Study& study, const StudyFolder& folder,
                               const io::Chunk& chunk, const Machine& machine,
                               const experiment::ProgressCallback& progress,
                               const std::atomic<bool>* stop) {
    const auto units = units_of(study);
    const auto [first, end] = chunk.of(units.size());
    std::set<size_t> failed_before;
    for (size_t i = first; i < end; ++i) {
        auto result = folder.result(study, units[i]);
        if (!result.ok()) return result.status();
        if (*result && !(*result)->failure.empty()) failed_before.insert(i);
    }
    WorkDone work;
    work.units = units.size();
    for (bool again = true; again;) {
        again = false;
        size_t done = 0;
        for (size_t i = first; i < end; ++i, ++done) {
            if (stop && *stop) return Status(StatusCode::canceled, "stopped");
            auto claim = io::Claim::take(folder.path() + "/" + claim_path(units[i]));
            if (!claim.ok()) return claim.status();
            if (!*claim) continue;
            // Another process has made it meanwhile.
            auto result = folder.result(study, units[i]);
            if (!result.ok()) return result.status();
            if (*result && !failed_before.contains(i)) {
                (*claim)->finish();
                continue;
            }
            failed_before.erase(i);
            auto made = measure_unit(study, units[i], folder.path(), machine,
                                     inside(progress, units[i], done, end - first), stop);
            if (!made.ok()) return made.status();
            if (Status status = folder.keep(units[i], *made); !status.ok()) return status;
            (*claim)->finish();
            ++work.made;
            again = true;
        }
    }
    for (const Unit& unit : units) {
        auto result = folder.result(study, unit);
        if (!result.ok()) return result.status();
        work.results += result->has_value();
    }
    return work;
}

}  // namespace postchain::study
