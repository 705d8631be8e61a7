// The last events, formatted once for all who listen.
//
// Listeners keep only the id they have got to, and take what follows from here, or from the store
// where it is older. So a slow one costs one batch of memory, and loses nothing.
#pragma once

#include <cstdint>
#include <deque>
#include <memory>
#include <string>
#include <vector>

#include "tools/service/work/service.h"

namespace postchain::service {

using EventText = std::shared_ptr<const std::string>;

struct EventBatch {
    std::vector<EventText> texts;  // oldest first
    int64_t last = 0;              // id up to which nothing is missing
    bool ends = false;             // the last one ends its job, and nothing has followed yet
};

class EventLog {
  public:
    // `newest`: the last id in the store, before which nothing is here. `keep`: how many are.
    EventLog(int64_t newest, size_t keep) : floor_(newest), newest_(newest), keep_(keep) {}

    void add(const std::vector<Event>& events);  // oldest first, all later than newest()
    int64_t newest() const { return newest_; }
    int64_t floor() const { return floor_; }  // the id before the first that is here
    // Whether all events later than `after` are here.
    bool covers(int64_t after) const { return after >= floor_; }
    // Those of a job (empty: of all) later than `after`, at most `most`. after: covered.
    EventBatch after(int64_t after, const std::string& job, size_t most) const;

  private:
    struct Entry {
        int64_t id = 0;
        std::string job;
        bool ends = false;
        EventText text;
    };
    std::deque<Entry> entries_;
    int64_t floor_ = 0;
    int64_t newest_ = 0;
    size_t keep_ = 0;
};

// The same of events of the store. `asked`: id after which they were looked for.
EventBatch batch_of(const std::vector<Event>& events, int64_t asked);
// The last id in the store; 0: none.
int64_t newest_event(const Service& service);

}  // namespace postchain::service
