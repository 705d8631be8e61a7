// The latest events, formatted once for all listeners.
//
// A listener stores only the id of its last event, and reads the following ones from here or, if
// they are older, from the store. A slow listener costs one batch of memory and loses nothing.
#pragma once

#include <cstdint>
#include <deque>
#include <memory>
#include <string>
#include <vector>

#include "tools/service/store/job.h"

namespace postchain::service {

using EventText = std::shared_ptr<const std::string>;

struct EventBatch {
    std::vector<EventText> texts;  // oldest first
    int64_t last = 0;              // all events up to this id have been delivered
    bool ends = false;             // the last event ends its job, and none has followed
};

class EventLog {
  public:
    // `newest`: the last id in the store. `keep`: maximum number of events in memory.
    EventLog(int64_t newest, size_t keep) : floor_(newest), newest_(newest), keep_(keep) {}

    void add(const std::vector<Event>& events);  // oldest first, all later than newest()
    int64_t newest() const { return newest_; }
    int64_t floor() const { return floor_; }  // the id before the first event in memory
    // Whether all events after `after` are in memory.
    bool covers(int64_t after) const { return after >= floor_; }
    // At most `most` events of a job (empty = of all jobs) after `after`, which must be covered.
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

// A batch of events from the store. `asked`: the id after which the store was searched.
EventBatch batch_of(const std::vector<Event>& events, int64_t asked);

}  // namespace postchain::service
