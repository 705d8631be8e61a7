// A Service without store and GL, for tests of HTTP: jobs are kept in memory, and a frame takes as
// long as it is told. Linked in place of postchain_service_work, it defines Service itself.
#pragma once

#include <chrono>
#include <memory>

#include "tools/service/work/service.h"

namespace postchain::service::test {

struct FakeSettings {
    std::chrono::milliseconds frame{0};    // that a frame takes; 0: jobs wait forever
    std::chrono::milliseconds picture{0};  // that a picture takes
    size_t max_queue = 1000;
    size_t picture_bytes = 64;
    size_t event_bytes = 0;  // more than needed, of each event
};
std::unique_ptr<Service> fake_service(const FakeSettings& settings);

}  // namespace postchain::service::test
