// Upkeep of a store: creates and converts its tables, removes old rows. Throws SqlError, or Status
// if the file is not a store of this program.
#pragma once

#include <cstdint>
#include <functional>
#include <string>

#include "tools/service/store/sqlite.h"

namespace postchain::service {

inline constexpr int64_t kApplication = 0x70634a53;  // "pcJS", the application_id of a store

// Ended jobs that a store keeps; the oldest ones are removed first.
struct Retention {
    int jobs = 1000;
    int days = 0;  // since their end; 0 = no limit
};
inline constexpr int kMaxEndedFrames = 200'000;  // in all
// Limit on events, without those of unfinished jobs.
inline constexpr int kMaxEvents = 100'000;

int64_t now_ms();  // since 1970-01-01 UTC

// Creates the tables of a new one, and converts those of an earlier version; `keep_copy` is called
// with that version before the first change. `path` is for messages.
void prepare(Database& database, const std::string& path,
             const std::function<void(int64_t version)>& keep_copy);

// The id of the last event, removed ones too; 0 = none yet.
int64_t newest_event_id(Database& database);
// Marks a copy, which begin_epoch() recognizes as restored.
void mark_copy(Database& database);
// If the store is an older copy of itself, the ids of its next events are larger than all that it
// has given before, and those in between count as lost. `last_seen`: the last id that this store
// is known to have given. Requires a transaction.
void begin_epoch(Database& database, int64_t last_seen);
// Whether an event's id is of a time that a restored copy does not know.
bool is_lost_event(Database& database, int64_t id);

// Removes old jobs and events, the ones that ended first. Returns a warning if the clock has
// jumped: then no job is removed by its age. Requires a transaction.
std::string prune(Database& database, const Retention& keep);

// Removes a job that has ended, with its frames and events. Its outputs stay on disk, and what they
// take stays in the ledger of its owner. False: it has not ended, or has tasks in another queue.
bool remove_job(Database& database, int64_t job);

// SQL of the strings of a request that a search reads, in lower case. `body`: its parameter.
std::string names_of_request(const std::string& body);

}  // namespace postchain::service
