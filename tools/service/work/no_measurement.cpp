// In place of tools/service/lab, in a service that is built without the lab.
#include "tools/service/work/measurement.h"

namespace postchain::service {

bool can_measure() {
    return false;
}

void add_measurement_keys(JobKind, BodyKeys&) {}

std::shared_ptr<Measurement> read_measurement(const MeasurementText&, JobRequest&) {
    return nullptr;
}

}  // namespace postchain::service
