// Upkeep of a store: creates its tables, recovers jobs of a dead process, removes old rows. Throws
// SqlError, or Status if the file is not a store of this program.
#pragma once

#include <cstdint>
#include <functional>
#include <string>

#include "tools/sequence/files/json.h"
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

// Stores an event: number of the job, type and data.
using EventSink = std::function<void(int64_t job, const std::string& type, const io::Json& data)>;

int64_t now_ms();  // since 1970-01-01 UTC

// Creates the tables of a new one. `path` is for messages.
void prepare(Database& database, const std::string& path);

// Recovers the jobs that ran when the last process died: docs/service.md, "After a crash". Requires
// a transaction.
void recover(Database& database, int most_attempts, const EventSink& add_event);

// Removes old jobs and events. Requires a transaction.
void prune(Database& database, const Retention& keep);

// Updates a job's counts of frames: all, done and failed.
void count_frames(Database& database, int64_t job);

}  // namespace postchain::service
