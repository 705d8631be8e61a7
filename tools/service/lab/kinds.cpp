#include "tools/service/work/measurement.h"

#include "tools/service/lab/ab_bench.h"
#include "tools/service/lab/study_job.h"
#include "tools/service/work/job_request.h"

namespace postchain::service {

bool can_measure() {
    return true;
}

void add_measurement_keys(JobKind kind, BodyKeys& keys) {
    if (kind == JobKind::study) {
        keys.emplace_back("study", string_or_object("a study's file, or the study as an object "
                                                    "(docs/studies.md)"));
        add_row_keys(study::study_parameters(), "", keys);
        return;
    }
    const bool is_ab = kind == JobKind::ab;
    add_row_keys(is_ab ? experiment::ab_parameters() : experiment::bench_parameters(), "", keys);
    keys.emplace_back("fail_above", strings_schema("METRIC=NUMBER, as --fail-above"));
    if (is_ab) {
        add_chain_keys("chain_b", keys);
    } else {
        keys.emplace_back("sweep", strings_schema("KEY=V1,V2,..., as --sweep"));
        keys.emplace_back("under", strings_schema("METRIC=NUMBER, as --under"));
    }
}

std::shared_ptr<Measurement> read_measurement(const MeasurementText& text, JobRequest& request) {
    if (request.kind == JobKind::study) return std::make_shared<StudyJob>(text);
    return std::make_shared<AbOrBench>(text, request);
}

}  // namespace postchain::service
