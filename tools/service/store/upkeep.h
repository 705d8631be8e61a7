// What is done to the file of a store besides what it is asked for: its tables, what a dead process
// has left, what is old. Throws SqlError, and Status where the file is not ours.
#pragma once

#include <cstdint>
#include <functional>
#include <string>

#include "tools/service/store/sqlite.h"

namespace postchain::service {

// What is kept of ended jobs: the newest, as long as there are no more of them and of their frames.
inline constexpr int kMaxEndedJobs = 1000;
inline constexpr int kMaxEndedFrames = 200'000;
// Events besides those of jobs that have not ended.
inline constexpr int kMaxEvents = 100'000;

// Enters an event of a job: its id, type and data.
using EventSink =
    std::function<void(const std::string& id, const std::string& type, const std::string& data)>;

int64_t now_ms();  // since 1970-01-01 UTC

// Takes the file for this process and makes the tables of a new one; `path` is for messages.
void prepare(Database& database, const std::string& path);

// Of the jobs that ran when the last process died: docs/service.md, "After a crash". In a
// transaction.
void recover(Database& database, int most_attempts, const EventSink& add_event);

// Removes old jobs and events. In a transaction.
void prune(Database& database);

// Enters how many frames a job has, and how many of them ended well or not.
void count_frames(Database& database, int64_t job);

}  // namespace postchain::service
