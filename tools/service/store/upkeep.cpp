#include "tools/service/store/upkeep.h"

#include <sqlite3.h>

#include <algorithm>
#include <chrono>
#include <vector>

namespace postchain::service {
namespace {

constexpr int64_t kVersion = 5;
constexpr int64_t kOldest = 4;  // that is converted; earlier ones were never released
constexpr int64_t kDayMs = 86'400'000;
// A clock that is further from its last known time has probably been set wrong.
constexpr int64_t kMaxPauseMs = 30 * kDayMs;
// Until the new time of such a clock is believed.
constexpr int64_t kConfirmMs = kDayMs;
// Events that a lost part of a store's history cannot have had.
constexpr int64_t kEpochEvents = int64_t(1) << 32;

// Bodies have a table of their own: SQLite would read and write up to 1 MiB with each row.
constexpr const char* kTables = R"sql(
CREATE TABLE jobs(
  id INTEGER PRIMARY KEY AUTOINCREMENT, kind TEXT NOT NULL, state TEXT NOT NULL,
  priority INTEGER NOT NULL, key TEXT NOT NULL, message TEXT NOT NULL DEFAULT '',
  created_ms INTEGER NOT NULL, started_ms INTEGER NOT NULL DEFAULT 0,
  ended_ms INTEGER NOT NULL DEFAULT 0, frames INTEGER NOT NULL DEFAULT 0,
  done INTEGER NOT NULL DEFAULT 0, failed INTEGER NOT NULL DEFAULT 0,
  exit_code INTEGER NOT NULL DEFAULT 0, verdict TEXT NOT NULL DEFAULT '',
  begun INTEGER NOT NULL DEFAULT 0, attempts INTEGER NOT NULL DEFAULT 0,
  owner TEXT NOT NULL DEFAULT '', bytes INTEGER NOT NULL DEFAULT 0,
  remote TEXT NOT NULL DEFAULT '', output TEXT NOT NULL DEFAULT '',
  about TEXT NOT NULL DEFAULT '{}', names TEXT NOT NULL DEFAULT '',
  writes TEXT NOT NULL DEFAULT '', ended_event INTEGER NOT NULL DEFAULT 0);
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

// Since version 5. ledger: bytes in the outputs of removed jobs. epochs: events between `after` and
// `first` are lost.
constexpr const char* kNewTables = R"sql(
CREATE TABLE requests(
  job INTEGER PRIMARY KEY REFERENCES jobs(id) ON DELETE CASCADE, body TEXT NOT NULL);
CREATE TABLE ledger(
  owner TEXT NOT NULL, writes TEXT NOT NULL, bytes INTEGER NOT NULL,
  PRIMARY KEY(owner, writes)) WITHOUT ROWID;
CREATE TABLE epochs(first INTEGER PRIMARY KEY, after INTEGER NOT NULL);
CREATE TABLE facts(name TEXT PRIMARY KEY, value INTEGER NOT NULL) WITHOUT ROWID;
)sql";

// With a job in another queue its tasks are still to be canceled.
constexpr const char* kEnded = "state IN ('done', 'failed', 'canceled') AND remote = ''";

// Facts: copied, clock_ms, jump_ms.
int64_t fact(Database& database, const char* name) {
    return database.number("SELECT value FROM facts WHERE name = ?", std::string(name));
}
void set_fact(Database& database, const char* name, int64_t value) {
    database.run("INSERT OR REPLACE INTO facts(name, value) VALUES(?, ?)", std::string(name),
                 value);
}

void convert(Database& database) {
    Transaction transaction(database);
    database.run(kNewTables);
    database.run(std::string("INSERT INTO requests(job, body) SELECT id, body FROM jobs"));
    database.run(std::string("ALTER TABLE jobs DROP COLUMN body"));
    for (const char* column : {"names TEXT NOT NULL DEFAULT ''", "writes TEXT NOT NULL DEFAULT ''",
                               "ended_event INTEGER NOT NULL DEFAULT 0"})
        database.run(concat("ALTER TABLE jobs ADD COLUMN ", column));
    database.run(concat("UPDATE jobs SET writes = output, names = IFNULL((SELECT ",
                        names_of_request("body"),
                        " FROM requests WHERE job = jobs.id), ''), ended_event = IFNULL((SELECT "
                        "MAX(id) FROM events WHERE job = jobs.id), 0)"));
    set_fact(database, "clock_ms", database.number("SELECT MAX(time_ms) FROM events"));
    database.run(concat("PRAGMA user_version = ", kVersion));
    transaction.commit();
}

// Whether ages may be computed with this time; `warning` says why not.
bool is_plausible(Database& database, int64_t now, std::string* warning) {
    const int64_t last = fact(database, "clock_ms");
    if (last == 0 || now - last <= kMaxPauseMs) {
        set_fact(database, "clock_ms", now);
        set_fact(database, "jump_ms", 0);
        return true;
    }
    const int64_t since = fact(database, "jump_ms");
    if (since > 0 && now >= since + kConfirmMs && now <= since + kMaxPauseMs) {
        set_fact(database, "clock_ms", now);
        set_fact(database, "jump_ms", 0);
        return true;
    }
    // A second jump begins the wait again.
    if (since == 0 || now < since || now > since + kMaxPauseMs) {
        set_fact(database, "jump_ms", now);
        *warning = concat("the clock is ", (now - last) / kDayMs,
                          " days after the last change of the store; jobs are not removed by "
                          "their age until it has been so for a day; check the clock");
    }
    return false;
}

}  // namespace

int64_t now_ms() {
    using namespace std::chrono;
    return duration_cast<milliseconds>(system_clock::now().time_since_epoch()).count();
}

std::string names_of_request(const std::string& body) {
    std::string text;
    for (const char* key : {"input", "output", "chain", "chain_b", "study", "camera"})
        text += concat(text.empty() ? "lower(" : " || ' ' || ", "CASE WHEN json_valid(", body,
                       ") THEN IFNULL(json_extract(", body, ", '$.", key, "'), '') ELSE '' END");
    return text + ")";
}

int64_t newest_event_id(Database& database) {
    return database.number("SELECT seq FROM sqlite_sequence WHERE name = 'events'");
}

void mark_copy(Database& database) {
    // The copy of a store of an earlier version, before it is converted, has no facts.
    if (database.number("PRAGMA user_version") >= 5) set_fact(database, "copied", 1);
}

void begin_epoch(Database& database, int64_t last_seen) {
    const int64_t newest = newest_event_id(database);
    if (newest >= last_seen && fact(database, "copied") == 0) return;
    // A time, because two copies of one store may be restored one after the other.
    const int64_t first = std::max({newest, last_seen, now_ms()}) + kEpochEvents;
    database.run("INSERT INTO epochs(first, after) VALUES(?, ?)", first, newest);
    if (database.run("UPDATE sqlite_sequence SET seq = ? WHERE name = 'events'", first - 1) == 0)
        database.run("INSERT INTO sqlite_sequence(name, seq) VALUES('events', ?)", first - 1);
    set_fact(database, "copied", 0);
}

bool is_lost_event(Database& database, int64_t id) {
    return id > newest_event_id(database) ||
           database.number("SELECT EXISTS(SELECT 1 FROM epochs WHERE after < ?1 AND ?1 < first)",
                           id) != 0;
}

void prepare(Database& database, const std::string& path,
             const std::function<void(int64_t version)>& keep_copy) {
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
    if (!empty && version < kOldest)
        throw Status(StatusCode::output,
                     path +
                         ": was created before the first release and is not read; start with a "
                         "new file for the store (--store)");
    if (!empty)
        if (const std::string found = database.text("PRAGMA quick_check(1)"); found != "ok")
            throw SqlError{SQLITE_CORRUPT, found};
    database.run("PRAGMA journal_mode = WAL");
    database.run("PRAGMA synchronous = FULL");
    if (!empty && version < kVersion) {
        keep_copy(version);
        convert(database);
    }
    database.run("PRAGMA foreign_keys = ON");
    if (!empty) return;
    Transaction transaction(database);
    database.run(kTables);
    database.run(kNewTables);
    database.run(concat("PRAGMA application_id = ", kApplication));
    database.run(concat("PRAGMA user_version = ", kVersion));
    transaction.commit();
}

bool remove_job(Database& database, int64_t job) {
    database.run(
        concat("INSERT INTO ledger(owner, writes, bytes) SELECT owner, writes, bytes FROM jobs "
               "WHERE id = ? AND bytes > 0 AND owner <> '' AND writes <> '' AND ",
               kEnded, " ON CONFLICT(owner, writes) DO UPDATE SET bytes = bytes + excluded.bytes"),
        job);
    return database.run(concat("DELETE FROM jobs WHERE id = ? AND ", kEnded), job) > 0;
}

std::string prune(Database& database, const Retention& keep) {
    std::string warning;
    const int64_t now = now_ms();
    const bool by_age = is_plausible(database, now, &warning) && keep.days > 0;
    if (keep.days == 0) warning.clear();
    int64_t jobs = 0, frames = 0;
    std::vector<int64_t> old;
    {
        const int64_t first = by_age ? now - keep.days * kDayMs : 0;
        // In the order of their last events, whatever the clock has been.
        Statement ended(database, concat("SELECT id, frames, ended_ms FROM jobs WHERE ", kEnded,
                                         " ORDER BY ended_event DESC, id DESC"));
        while (ended.step()) {
            ++jobs;
            frames += ended.integer(1);
            // The newest job has no limit of frames.
            if (jobs > keep.jobs || (jobs > 1 && frames > kMaxEndedFrames) ||
                ended.integer(2) < first)
                old.push_back(ended.integer(0));
        }
    }
    for (const int64_t job : old) remove_job(database, job);
    int64_t last = newest_event_id(database) - kMaxEvents;
    // The ids between two epochs are no events.
    Statement epoch(database, "SELECT first, after FROM epochs ORDER BY first DESC LIMIT 1");
    if (epoch.step() && last < epoch.integer(0)) last -= epoch.integer(0) - 1 - epoch.integer(1);
    database.run(concat("DELETE FROM events WHERE id <= ? AND job IN (SELECT id FROM jobs WHERE ",
                        kEnded, ")"),
                 last);
    return warning;
}

}  // namespace postchain::service
