#include "tools/service/store/queue_order.h"

#include <algorithm>
#include <set>
#include <tuple>

namespace postchain::service {

QueuePlaces places_of(const std::vector<WaitingJob>& jobs) {
    // Each owner's jobs of one priority in their order, the next one last.
    std::map<int, std::map<std::string, std::vector<int64_t>>, std::greater<>> levels;
    std::map<std::string, int64_t> turns;
    int64_t latest = 0;
    for (const WaitingJob& job : jobs) {
        levels[job.priority][job.owner].push_back(job.id);
        turns[job.owner] = job.turn;
        latest = std::max(latest, job.turn);
    }
    QueuePlaces places;
    for (auto& [priority, owners] : levels) {
        std::set<std::tuple<int64_t, int64_t, std::string>> heads;  // turn, id, owner
        for (auto& [owner, ids] : owners) {
            std::sort(ids.begin(), ids.end(), std::greater<>());
            heads.emplace(turns[owner], ids.back(), owner);
        }
        while (!heads.empty()) {
            const auto [turn, id, owner] = *heads.begin();
            heads.erase(heads.begin());
            places.emplace(std::to_string(id), int(places.size()) + 1);
            turns[owner] = ++latest;
            auto& ids = owners[owner];
            ids.pop_back();
            if (!ids.empty()) heads.emplace(turns[owner], ids.back(), owner);
        }
    }
    return places;
}

}  // namespace postchain::service
