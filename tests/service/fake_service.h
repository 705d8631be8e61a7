// A Service without store and GL, for tests of HTTP. Jobs are kept in memory, and frames take a
// given time. Defines Service, so it is linked instead of postchain_service_work.
#pragma once

#include <chrono>
#include <memory>

#include "tools/service/work/service.h"

namespace postchain::service::test {

struct FakeSettings {
    std::chrono::milliseconds frame{0};  // per frame; 0 = jobs wait forever
    std::chrono::milliseconds picture{
        0};  // per image, and to read the folder "slow"; "endless" takes until nobody waits
    size_t max_queue = 1000;
    size_t picture_bytes = 64;
    size_t event_bytes = 0;  // padding of each event
    size_t past_events = 0;  // those of before the start
};
std::unique_ptr<Service> fake_service(const FakeSettings& settings);

}  // namespace postchain::service::test
