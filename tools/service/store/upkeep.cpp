#include "tools/service/store/upkeep.h"

#include <sqlite3.h>

#include <chrono>
#include <utility>
#include <vector>

namespace postchain::service {
namespace {

constexpr int64_t kVersion = 4;  // earlier ones were never released
constexpr int64_t kDayMs = 86'400'000;

constexpr const char* kTables = R"sql(
CREATE TABLE jobs(
  id INTEGER PRIMARY KEY AUTOINCREMENT, kind TEXT NOT NULL, state TEXT NOT NULL,
  priority INTEGER NOT NULL, body TEXT NOT NULL, key TEXT NOT NULL, message TEXT NOT NULL DEFAULT '',
  created_ms INTEGER NOT NULL, started_ms INTEGER NOT NULL DEFAULT 0,
  ended_ms INTEGER NOT NULL DEFAULT 0, frames INTEGER NOT NULL DEFAULT 0,
  done INTEGER NOT NULL DEFAULT 0, failed INTEGER NOT NULL DEFAULT 0,
  exit_code INTEGER NOT NULL DEFAULT 0, verdict TEXT NOT NULL DEFAULT '',
  begun INTEGER NOT NULL DEFAULT 0, attempts INTEGER NOT NULL DEFAULT 0,
  owner TEXT NOT NULL DEFAULT '', bytes INTEGER NOT NULL DEFAULT 0,
  remote TEXT NOT NULL DEFAULT '', output TEXT NOT NULL DEFAULT '',
  about TEXT NOT NULL DEFAULT '{}');
CREATE UNIQUE INDEX jobs_key ON jobs(key) WHERE key <> '';
CREATE INDEX jobs_queue ON jobs(state, priority DESC, id);
CREATE TABLE frames(
  job INTEGER NOT NULL REFERENCES jobs(id) ON DELETE CASCADE, place INTEGER NOT NULL,
  frame INTEGER NOT NULL, state TEXT NOT NULL, attempts INTEGER NOT NULL DEFAULT 0,
  begun INTEGER NOT NULL DEFAULT 0, in_flight INTEGER NOT NULL DEFAULT 0,
  alone INTEGER NOT NULL DEFAULT 0, held INTEGER NOT NULL DEFAULT 0, output TEXT NOT NULL, message TEXT NOT NULL DEFAULT '',
  filter_ms REAL NOT NULL DEFAULT 0,
  PRIMARY KEY(job, frame)) WITHOUT ROWID;
CREATE TABLE events(
  id INTEGER PRIMARY KEY AUTOINCREMENT, job INTEGER NOT NULL REFERENCES jobs(id) ON DELETE CASCADE,
  time_ms INTEGER NOT NULL, type TEXT NOT NULL, data TEXT NOT NULL);
CREATE INDEX events_job ON events(job, id);
CREATE TABLE turns(owner TEXT PRIMARY KEY, turn INTEGER NOT NULL);
)sql";

// With a job in another queue its tasks are still to be canceled.
constexpr const char* kEnded = "state IN ('done', 'failed', 'canceled') AND remote = ''";

}  // namespace

int64_t now_ms() {
    using namespace std::chrono;
    return duration_cast<milliseconds>(system_clock::now().time_since_epoch()).count();
}

void count_frames(Database& database, int64_t job) {
    database.run(
        "UPDATE jobs SET frames = (SELECT COUNT(*) FROM frames WHERE job = ?1), "
        "done = (SELECT COUNT(*) FROM frames WHERE job = ?1 AND state IN ('written', "
        "'skipped')), failed = (SELECT COUNT(*) FROM frames WHERE job = ?1 AND state IN "
        "('missing', 'quarantined')) WHERE id = ?1 AND EXISTS(SELECT 1 FROM frames WHERE job = ?1)",
        job);
}

void prepare(Database& database, const std::string& path) {
    database.run("BEGIN IMMEDIATE");
    const bool empty = database.number("SELECT COUNT(*) FROM sqlite_master") == 0;
    const int64_t application = database.number("PRAGMA application_id");
    const int64_t version = database.number("PRAGMA user_version");
    database.run("COMMIT");
    if (!empty && application != kApplication)
        throw Status(
            StatusCode::output,
            path + ": is a database of another program; choose another file for the store");
    if (version > kVersion)
        throw Status(StatusCode::output,
                     concat(path, ": was created by a later version (store version ", version,
                            ", this program reads up to ", kVersion,
                            "); use that version, or choose another file"));
    if (!empty && version < kVersion)
        throw Status(StatusCode::output,
                     path +
                         ": was created before the first release and is not read; start with a "
                         "new file for the store (--store)");
    if (!empty)
        if (const std::string found = database.text("PRAGMA quick_check(1)"); found != "ok")
            throw SqlError{SQLITE_CORRUPT, found};
    database.run("PRAGMA journal_mode = WAL");
    database.run("PRAGMA synchronous = FULL");
    database.run("PRAGMA foreign_keys = ON");
    if (!empty) return;
    Transaction transaction(database);
    database.run(kTables);
    database.run(concat("PRAGMA application_id = ", kApplication));
    database.run(concat("PRAGMA user_version = ", kVersion));
    transaction.commit();
}

void recover(Database& database, int most_attempts, const EventSink& add_event) {
    std::vector<std::pair<int64_t, int>> found;  // jobs with their attempts
    {
        // A job in another queue goes on without this process: its death is no attempt.
        Statement jobs(database,
                       "SELECT id, CASE remote WHEN '' THEN attempts ELSE 0 END FROM jobs WHERE "
                       "state = 'running'");
        while (jobs.step()) found.emplace_back(jobs.integer(0), int(jobs.integer(1)));
    }
    for (const auto& [job, attempts] : found) {
        const int64_t in_flight =
            database.number("SELECT COUNT(*) FROM frames WHERE job = ? AND in_flight = 1", job);
        // One of several frames in flight may have killed the process. The attempt counts for none
        // of them, and each runs alone from now on. For a frame that ran alone it counts.
        if (in_flight > 1)
            database.run(
                "UPDATE frames SET attempts = attempts - 1 WHERE job = ? AND in_flight = 1", job);
        std::vector<int> given_up;
        {
            Statement frames(database,
                             "SELECT frame FROM frames WHERE job = ? AND in_flight = 1 AND "
                             "attempts >= ?",
                             job, most_attempts);
            while (frames.step()) given_up.push_back(int(frames.integer(0)));
        }
        for (const int frame : given_up) {
            const std::string message = concat(
                "the process died while only this frame was in "
                "flight, at the last of ",
                most_attempts, " attempts");
            database.run(
                "UPDATE frames SET state = 'quarantined', message = ? WHERE job = ? AND frame = ?",
                message, job, frame);
            add_event(job, "quarantined", {{"frame", frame}, {"message", message}});
        }
        count_frames(database, job);
        if (in_flight == 0 && attempts >= most_attempts) {
            const std::string message =
                concat("the process died ", attempts, " times during this job");
            database.run(
                "UPDATE jobs SET state = 'failed', exit_code = 1, message = ?, ended_ms = ? WHERE "
                "id = ?",
                message, now_ms(), job);
            add_event(job, "failed", {{"message", message}});
            continue;
        }
        database.run("UPDATE jobs SET state = 'queued', attempts = ? WHERE id = ?",
                     in_flight > 0 ? 0 : attempts, job);
        add_event(job, "requeued", {{"why", "the process ended"}});
    }
    database.run("UPDATE frames SET in_flight = 0, alone = 1 WHERE in_flight = 1");
}

void prune(Database& database, const Retention& keep) {
    int64_t jobs = 0, frames = 0;
    std::vector<int64_t> old;
    {
        const int64_t first = keep.days > 0 ? now_ms() - keep.days * kDayMs : 0;
        Statement ended(database, concat("SELECT id, frames, ended_ms FROM jobs WHERE ", kEnded,
                                         " ORDER BY ended_ms DESC, id DESC"));
        while (ended.step()) {
            ++jobs;
            frames += ended.integer(1);
            // The newest job has no limit of frames.
            if (jobs > keep.jobs || (jobs > 1 && frames > kMaxEndedFrames) ||
                ended.integer(2) < first)
                old.push_back(ended.integer(0));
        }
    }
    for (const int64_t job : old) database.run("DELETE FROM jobs WHERE id = ?", job);
    database.run(concat("DELETE FROM events WHERE id <= (SELECT MAX(id) FROM events) - ? AND job "
                        "IN (SELECT id FROM jobs WHERE ",
                        kEnded, ")"),
                 kMaxEvents);
}

}  // namespace postchain::service
