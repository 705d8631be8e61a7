// The order of waiting jobs: the highest priority first; of equals the one whose owner had its turn
// longest ago; then the oldest.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

namespace postchain::service {

struct WaitingJob {
    int64_t id = 0;
    int priority = 0;
    std::string owner;
    int64_t turn = 0;  // when its owner last had one; later turns are larger
};
using QueuePlaces = std::map<std::string, int>;  // by id, from 1

// If each job runs to its end and no other is submitted.
QueuePlaces places_of(const std::vector<WaitingJob>& jobs);

}  // namespace postchain::service
