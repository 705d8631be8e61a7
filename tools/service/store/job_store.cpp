#include "tools/service/store/job_store.h"

#include <algorithm>
#include <charconv>
#include <set>
#include <sstream>
#include <tuple>

#include "chain/base/status.h"
#include "chain/base/text.h"

namespace postchain::service {
namespace {

// ------------------------------------------------------------------------------------------ rows
// The queries of job_of() and frame_of(), up to WHERE. Lists are read without bodies.
std::string query_of_jobs(bool bodies) {
    return concat("SELECT id, kind, state, priority, ",
                  bodies ? "IFNULL((SELECT body FROM requests WHERE job = jobs.id), '')" : "''",
                  ", message, created_ms, started_ms, ended_ms, frames, done, failed, exit_code, "
                  "verdict, owner, bytes, about, begun, remote FROM jobs ");
}
constexpr const char* kFrame =
    "SELECT frame, state, attempts, output, message, filter_ms FROM frames ";

template <class Enum, size_t n>
Enum named(const std::string& name, const std::array<Enum, n>& all, Enum otherwise) {
    for (const Enum one : all)
        if (name == name_of(one)) return one;
    return otherwise;
}

// The number of a displayed id; 0 if it is not an id.
int64_t number_of(const std::string& id) {
    int64_t number = 0;
    const char* end = id.data() + id.size();
    const auto parsed = std::from_chars(id.data(), end, number);
    const bool good = parsed.ec == std::errc() && parsed.ptr == end && number > 0;
    return good && std::to_string(number) == id ? number : 0;
}

JobState state_of(const std::string& name) {
    return named(name, kJobStates, JobState::failed);
}

Job job_of(const Statement& row) {
    Job job;
    job.id = row.text(0);
    job.kind = named(row.text(1), kJobKinds, JobKind::run);
    job.state = state_of(row.text(2));
    job.priority = int(row.integer(3));
    job.body = row.text(4);
    job.message = row.text(5);
    job.created_ms = row.integer(6);
    job.started_ms = row.integer(7);
    job.ended_ms = row.integer(8);
    job.frames = int(row.integer(9));
    job.done = int(row.integer(10));
    job.failed = int(row.integer(11));
    job.exit_code = int(row.integer(12));
    job.verdict = row.text(13);
    job.owner = row.text(14);
    job.bytes = row.integer(15);
    job.about = row.text(16);
    job.begun = row.integer(17) != 0;
    job.remote = row.text(18);
    return job;
}

JobFrame frame_of(const Statement& row) {
    JobFrame frame;
    frame.frame = int(row.integer(0));
    frame.state = named(row.text(1), kFrameStates, FrameState::waiting);
    frame.attempts = int(row.integer(2));
    frame.output = row.text(3);
    frame.message = row.text(4);
    frame.filter_ms = row.number(5);
    return frame;
}

// ----------------------------------------------------------------- the queue, limits, the search
// The reason that the owner may not have so many jobs and frames more; empty = they may.
std::string over_limit(Database& database, int new_jobs, int new_frames, const User& owner) {
    Statement used(database,
                   "SELECT COUNT(*) FILTER (WHERE ended_ms = 0), SUM(frames - done - failed) "
                   "FILTER (WHERE ended_ms = 0), IFNULL(SUM(bytes), 0) + IFNULL((SELECT "
                   "SUM(bytes) FROM ledger WHERE owner = ?1), 0) FROM jobs WHERE owner = ?1",
                   owner.name);
    used.step();
    const int64_t jobs = used.integer(0) + new_jobs, frames = used.integer(1) + new_frames;
    if (owner.max_jobs > 0 && jobs > owner.max_jobs)
        return concat(owner.name, " may have ", owner.max_jobs,
                      " unfinished jobs; wait until one has ended, or cancel one");
    if (owner.max_frames > 0 && frames > owner.max_frames)
        return concat(owner.name, " may have ", owner.max_frames,
                      " frames in unfinished jobs, and would have ", frames,
                      "; submit fewer, or wait");
    if (owner.max_bytes > 0 && used.integer(2) >= owner.max_bytes)
        return concat("max_disk: the jobs of ", owner.name, " have written ", used.integer(2),
                      " bytes, the limit is ", owner.max_disk,
                      ", removed jobs included; delete outputs that are not needed, and remove "
                      "their jobs");
    return "";
}

bool is_full(Database& database, size_t max_queue) {
    return uint64_t(database.number("SELECT COUNT(*) FROM jobs WHERE state = 'queued'")) >=
           max_queue;
}

std::string full_text(size_t max_queue) {
    return concat(max_queue, max_queue == 1 ? " job is" : " jobs are", " waiting; try again later");
}

// Updates a job's counts of frames: all, done and failed.
void count_frames(Database& database, int64_t job) {
    database.run(
        "UPDATE jobs SET frames = (SELECT COUNT(*) FROM frames WHERE job = ?1), "
        "done = (SELECT COUNT(*) FROM frames WHERE job = ?1 AND state IN ('written', "
        "'skipped')), failed = (SELECT COUNT(*) FROM frames WHERE job = ?1 AND state IN "
        "('missing', 'quarantined')) WHERE id = ?1 AND EXISTS(SELECT 1 FROM frames WHERE job = ?1)",
        job);
}

template <class... Values>
std::optional<Job> job_where(Database& database, const char* where, const Values&... values) {
    return first(Statement(database, concat(query_of_jobs(true), "WHERE ", where), values...),
                 job_of);
}

// With a job in another queue its tasks are still to be canceled.
constexpr const char* kEnded = "state IN ('done', 'failed', 'canceled') AND remote = ''";

// SQL of the strings of a request that a search reads, in lower case. `body`: its parameter.
std::string names_of_request(const std::string& body) {
    std::string text;
    for (const char* key : {"input", "output", "chain", "chain_b", "study", "camera"})
        text += concat(text.empty() ? "lower(" : " || ' ' || ", "CASE WHEN json_valid(", body,
                       ") THEN IFNULL(json_extract(", body, ", '$.", key, "'), '') ELSE '' END");
    return text + ")";
}

// Of the last one, removed ones too; 0 = none yet.
int64_t newest_event_id(Database& database) {
    return database.number("SELECT seq FROM sqlite_sequence WHERE name = 'events'");
}

// Its outputs stay on disk, and what they take stays in the ledger of its owner. False: it has not
// ended, or has tasks in another queue.
bool remove_job(Database& database, int64_t job) {
    database.run(
        concat("INSERT INTO ledger(owner, writes, bytes) SELECT owner, writes, bytes FROM jobs "
               "WHERE id = ? AND bytes > 0 AND owner <> '' AND writes <> '' AND ",
               kEnded, " ON CONFLICT(owner, writes) DO UPDATE SET bytes = bytes + excluded.bytes"),
        job);
    return database.run(concat("DELETE FROM jobs WHERE id = ? AND ", kEnded), job) > 0;
}

struct WaitingJob {
    int64_t id = 0;
    int priority = 0;
    std::string owner;
    int64_t turn = 0;  // when its owner last had one; later turns are larger
};

// If each job runs to its end and no other is submitted: the highest priority first; among equals
// the one whose owner had its turn longest ago; then the oldest.
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
            std::ranges::sort(ids, std::greater<>());
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

// A JSON list of at most 16.
std::string words_of(const std::string& search) {
    constexpr size_t kMaxWords = 16;
    std::istringstream text(search);
    io::Json words = io::Json::array();
    for (std::string word; words.size() < kMaxWords && text >> word;) words.push_back(word);
    return io::json_text(words);
}

}  // namespace

Result<std::unique_ptr<JobStore>> JobStore::open(const std::string& path, int attempts,
                                                 const Retention& keep) {
    std::unique_ptr<JobStore> store(new JobStore(path, attempts, keep));
    RETURN_IF_ERROR(store->take());
    RETURN_IF_ERROR(store->change([&](Database& database) {
        store->recover(database);
        store->prune(database);
    }));
    return store;
}

// Removes old jobs and events, the ones that ended first.
void JobStore::prune(Database& database) {
    constexpr int64_t kDayMs = 86'400'000;
    const int64_t oldest = keep_.days > 0 ? now_ms() - keep_.days * kDayMs : 0;
    // In the order of their last events, whatever the clock has been. The newest job has no limit
    // of frames.
    const auto old = all(
        Statement(database,
                  concat("SELECT id FROM (SELECT id, ended_ms, row_number() OVER last AS jobs, "
                         "SUM(frames) OVER last AS frames FROM jobs WHERE ",
                         kEnded,
                         " WINDOW last AS (ORDER BY ended_event DESC, id DESC)) WHERE jobs > ? OR "
                         "(jobs > 1 AND frames > ?) OR ended_ms < ?"),
                  keep_.jobs, kMaxEndedFrames, oldest),
        [](const Statement& row) { return row.integer(0); });
    for (const int64_t job : old) remove_job(database, job);
    database.run(concat("DELETE FROM events WHERE id <= ? AND job IN (SELECT id FROM jobs WHERE ",
                        kEnded, ")"),
                 newest_event_id(database) - kMaxEvents);
}

Result<Added> JobStore::add(const NewJob& job, size_t max_queue, const User& owner) {
    return change([&](Database& database) {
        if (!job.key.empty())
            if (auto same = job_where(database, "key = ?", job.key)) {
                const bool equal = same->body == job.body && same->owner == owner.name;
                return Added{equal ? Added::Result::same : Added::Result::other_body, *same, ""};
            }
        if (is_full(database, max_queue))
            return Added{Added::Result::full, {}, full_text(max_queue)};
        if (auto why = over_limit(database, 1, job.frames, owner); !why.empty())
            return Added{Added::Result::over_limit, {}, why};
        // Nothing settles the ledger of an owner without a limit.
        if (owner.max_bytes == 0) database.run("DELETE FROM ledger WHERE owner = ?", owner.name);
        database.run(
            "INSERT INTO jobs(kind, state, priority, key, created_ms, owner, frames, output, "
            "about, writes) VALUES(?, 'queued', ?, ?, ?, ?, ?, ?, ?, ?)",
            name_of(job.kind), job.priority, job.key, now_ms(), owner.name, job.frames, job.output,
            job.about, job.writes);
        const int64_t id = database.getLastInsertRowid();
        database.run("INSERT INTO requests(job, body) VALUES(?, ?)", id, job.body);
        database.run(concat("UPDATE jobs SET names = ", names_of_request("?1"), " WHERE id = ?2"),
                     job.body, id);
        add_event(id, "queued", {{"kind", name_of(job.kind)}, {"priority", job.priority}});
        return Added{Added::Result::made, *job_where(database, "id = ?", id), ""};
    });
}

Result<std::optional<Job>> JobStore::job(const std::string& id) const {
    return row(job_of, query_of_jobs(true) + "WHERE id = ?", number_of(id));
}

Result<std::optional<Job>> JobStore::listed(const std::string& id) const {
    return row(job_of, query_of_jobs(false) + "WHERE id = ?", number_of(id));
}

Result<std::optional<Job>> JobStore::job_of_key(const std::string& key) const {
    return row(job_of, query_of_jobs(true) + "WHERE key = ? AND key <> ''", key);
}

Result<std::vector<Job>> JobStore::jobs(const std::string& state, const std::string& before,
                                        size_t limit, const std::string& owner,
                                        const std::string& search) const {
    // No jobs are older than an invalid id.
    const int64_t last = before.empty() ? 0 : std::max<int64_t>(number_of(before), 1);
    return rows(job_of,
                query_of_jobs(false) +
                    "WHERE (?1 = '' OR state = ?1) AND (?2 = 0 OR id < ?2) AND (?4 = '' OR owner = "
                    "?4) AND NOT EXISTS(SELECT 1 FROM json_each(?5) WHERE instr(lower(id || ' ' || "
                    "kind || ' ' || state || ' ' || owner || ' ' || message) || ' ' || names, "
                    "lower(value)) = 0) ORDER BY id DESC LIMIT ?3",
                state, last, int64_t(limit), owner, words_of(search));
}

Result<std::vector<Job>> JobStore::writers(const std::string& output) const {
    return rows(job_of,
                query_of_jobs(true) +
                    "WHERE state IN ('queued', 'running') AND output = ? AND output <> '' ORDER BY "
                    "id",
                output);
}

Result<QueuePlaces> JobStore::places() const {
    const auto waiting_of = [](const Statement& row) {
        return WaitingJob{row.integer(0), int(row.integer(1)), row.text(2), row.integer(3)};
    };
    ASSIGN_OR_RETURN(const auto waiting,
                     rows(waiting_of,
                          "SELECT id, priority, owner, IFNULL((SELECT turn FROM turns WHERE "
                          "turns.owner = jobs.owner), 0) FROM jobs WHERE state = 'queued'"));
    return places_of(waiting);
}

Result<std::vector<Event>> JobStore::events(const std::string& id, int64_t after,
                                            size_t limit) const {
    const auto read = [&](Database& database) {
        return all(
            Statement(
                database,
                concat("SELECT id, job, time_ms, type, data FROM events WHERE ",
                       id.empty() ? "?1 = 0" : "job = ?1", " AND id > ?2 ORDER BY id LIMIT ?3"),
                id.empty() ? 0 : number_of(id), after, int64_t(limit)),
            [](const Statement& row) {
                return Event{row.integer(0), row.text(1), row.integer(2), row.text(3), row.text(4)};
            });
    };
    return look(read, Reading::streams);
}

Result<int64_t> JobStore::newest_event() const {
    return look([](Database& database) { return newest_event_id(database); });
}

StoreUse JobStore::use() const {
    const auto found = look([&](Database& database) {
        StoreUse use;
        Statement states(database, "SELECT state, COUNT(*) FROM jobs GROUP BY state");
        while (states.step()) use.jobs[state_of(states.text(0))] = size_t(states.integer(1));
        use.oldest_queued_ms =
            database.number("SELECT MIN(created_ms) FROM jobs WHERE state = 'queued'");
        Statement owners(database,
                         "SELECT owner, SUM(bytes) FROM (SELECT owner, bytes FROM jobs WHERE owner "
                         "<> '' UNION ALL SELECT owner, bytes FROM ledger) GROUP BY owner");
        while (owners.step()) use.bytes[owners.text(0)] = owners.integer(1);
        return use;
    });
    return found.ok() ? *found : StoreUse();
}

Result<std::optional<Job>> JobStore::next(int above,
                                          const std::vector<std::string>& without) const {
    return row(job_of,
               query_of_jobs(false) +
                   "WHERE state = 'queued' AND priority >= ? AND owner NOT IN (SELECT value FROM "
                   "json_each(?)) ORDER BY priority DESC, IFNULL((SELECT turn FROM turns WHERE "
                   "turns.owner = jobs.owner), 0), id LIMIT 1",
               above, io::json_text(io::Json(without)));
}

Result<bool> JobStore::start(const std::string& id) {
    return change([&](Database& database) {
        const int64_t job = number_of(id);
        if (database.run("UPDATE jobs SET state = 'running' WHERE id = ? AND state = 'queued'",
                         job) == 0)
            return false;
        database.run(
            "INSERT OR REPLACE INTO turns(owner, turn) SELECT owner, (SELECT IFNULL(MAX(turn), 0) "
            "+ 1 FROM turns) FROM jobs WHERE id = ?",
            job);
        add_event(job, "started");
        // The time of its first such event: the log tells the first start by it.
        database.run(
            "UPDATE jobs SET started_ms = (SELECT time_ms FROM events ORDER BY id DESC LIMIT 1) "
            "WHERE id = ? AND started_ms = 0",
            job);
        return true;
    });
}

Status JobStore::began(const std::string& id) {
    return set("UPDATE jobs SET begun = 1 WHERE id = ?", number_of(id));
}

Status JobStore::requeue(const std::string& id, const std::string& why) {
    return change([&](Database& database) {
        if (database.run("UPDATE jobs SET state = 'queued' WHERE id = ? AND state = 'running'",
                         number_of(id)) > 0)
            add_event(number_of(id), "requeued", {{"why", why}});
    });
}

// The event of a job's end, by which prune() knows the order of ends.
void JobStore::add_end(Database& database, int64_t job, JobState state, const io::Json& data) {
    add_event(job, name_of(state), data);
    database.run("UPDATE jobs SET ended_event = ? WHERE id = ?", newest_event_id(database), job);
}

Status JobStore::end(const Job& job) {
    return change([&](Database& database) {
        const int64_t id = number_of(job.id);
        io::Json data = {{"exit_code", job.exit_code}};
        if (!job.message.empty()) data["message"] = job.message;
        if (!job.verdict.empty()) data["verdict"] = job.verdict;
        if (database.run("UPDATE jobs SET state = ?, message = ?, exit_code = ?, verdict = ?, "
                         "ended_ms = ?, done = CASE WHEN kind <> 'run' AND ?1 = 'done' THEN frames "
                         "ELSE done END WHERE id = ? AND state = 'running'",
                         name_of(job.state), job.message, job.exit_code, job.verdict, now_ms(),
                         id) > 0)
            add_end(database, id, job.state, data);
        prune(database);
    });
}

Status JobStore::has_written(const std::string& id, int64_t bytes) {
    return set("UPDATE jobs SET bytes = ? WHERE id = ?", bytes, number_of(id));
}

Result<bool> JobStore::cancel(const std::string& id, int exit_code) {
    return change([&](Database& database) {
        const int64_t job = number_of(id);
        const bool done =
            database.run(
                "UPDATE jobs SET state = 'canceled', message = 'canceled', exit_code = ?, ended_ms "
                "= ? WHERE id = ? AND state IN ('queued', 'running')",
                exit_code, now_ms(), job) > 0;
        if (done) add_end(database, job, JobState::canceled, io::Json::object());
        return done;
    });
}

Result<Retried> JobStore::retry(const std::string& id, const User& owner, size_t max_queue) {
    return change([&](Database& database) {
        const int64_t job = number_of(id);
        Statement ended(database,
                        "SELECT frames - done FROM jobs WHERE id = ? AND state IN ('failed', "
                        "'canceled')",
                        job);
        if (!ended.step()) return Retried();
        if (is_full(database, max_queue)) return Retried{false, full_text(max_queue)};
        if (auto why = over_limit(database, 1, int(ended.integer(0)), owner); !why.empty())
            return Retried{false, why};
        database.run(
            "UPDATE jobs SET state = 'queued', message = '', exit_code = 0, verdict = '', ended_ms "
            "= 0 WHERE id = ?",
            job);
        database.run(
            "UPDATE frames SET state = 'waiting', attempts = 0, message = '' WHERE job = ? AND "
            "state IN ('quarantined', 'missing', 'waiting')",
            job);
        count_frames(database, job);
        add_event(job, "requeued", {{"why", "asked for"}});
        return Retried{true, ""};
    });
}

Result<bool> JobStore::set_priority(const std::string& id, int priority) {
    return change([&](Database& database) {
        const int64_t job = number_of(id);
        const bool done =
            database.run(
                "UPDATE jobs SET priority = ? WHERE id = ? AND state IN ('queued', 'running')",
                priority, job) > 0;
        if (done) add_event(job, "priority", {{"priority", priority}});
        return done;
    });
}

Result<bool> JobStore::forget(const std::string& id) {
    return change([&](Database& database) { return remove_job(database, number_of(id)); });
}

Result<std::string> JobStore::over_disk(const User& owner) const {
    if (owner.max_bytes == 0) return std::string();
    User of_disk = owner;
    of_disk.max_jobs = of_disk.max_frames = 0;
    return look([&](Database& database) { return over_limit(database, 0, 0, of_disk); });
}

Result<std::vector<LedgerEntry>> JobStore::ledger(const std::string& owner) const {
    return rows(
        [](const Statement& row) {
            return LedgerEntry{row.text(0), row.integer(1)};
        },
        "SELECT writes, bytes FROM ledger WHERE owner = ?", owner);
}

Status JobStore::settle(const std::string& owner, const std::string& writes, int64_t bytes) {
    return change([&](Database& database) {
        database.run("UPDATE ledger SET bytes = MIN(bytes, ?) WHERE owner = ? AND writes = ?",
                     bytes, owner, writes);
        database.run("DELETE FROM ledger WHERE bytes <= 0");
    });
}

Result<std::vector<Job>> JobStore::remotes() const {
    // A queued one follows when it has started again.
    return rows(job_of,
                query_of_jobs(false) + "WHERE remote <> '' AND state <> 'queued' ORDER BY id");
}

Status JobStore::set_remote(const std::string& id, const std::string& remote) {
    return set("UPDATE jobs SET remote = ? WHERE id = ?", remote, number_of(id));
}

Status JobStore::say(const std::string& id, const std::string& type, const io::Json& data) {
    return change([&](Database&) { add_event(number_of(id), type, data); });
}

// ---------------------------------------------------------------------------------------- frames

Result<std::vector<JobFrame>> JobStore::frames(const std::string& id, size_t from,
                                               size_t limit) const {
    return rows(frame_of, concat(kFrame, "WHERE job = ? ORDER BY place LIMIT ? OFFSET ?"),
                number_of(id), int64_t(limit), int64_t(from));
}

Result<std::optional<JobFrame>> JobStore::frame(const std::string& id, int frame) const {
    return row(frame_of, concat(kFrame, "WHERE job = ? AND frame = ?"), number_of(id), frame);
}

Result<FrameTally> JobStore::tally(const std::string& id) const {
    return look([&](Database& database) {
        FrameTally tally;
        Statement found(
            database,
            "SELECT frame, state, held, message FROM frames WHERE job = ? AND (state NOT IN "
            "('written', 'skipped') OR held = 1) ORDER BY place",
            number_of(id));
        while (found.step()) {
            const std::string state = found.text(1);
            if (state == "waiting") ++tally.waiting;
            if (state == "missing") ++tally.missing;
            if (state == "quarantined") {
                if (tally.quarantined.empty()) tally.reason = found.text(3);
                tally.quarantined.push_back(int(found.integer(0)));
            }
            if (found.integer(2) != 0) ++tally.held;
        }
        return tally;
    });
}

Result<std::vector<FrameToDo>> JobStore::to_do(const std::string& id) const {
    const auto to_do_of = [](const Statement& row) {
        return FrameToDo{int(row.integer(0)), int(row.integer(1)), row.integer(2) != 0,
                         row.integer(3) != 0};
    };
    return rows(to_do_of,
                "SELECT frame, attempts, begun, alone FROM frames WHERE job = ? AND state = "
                "'waiting' ORDER BY place",
                number_of(id));
}

Status JobStore::enter_frames(const std::string& id, const std::vector<JobFrame>& frames) {
    return change([&](Database& database) {
        const int64_t job = number_of(id);
        int64_t place = 0;
        for (const JobFrame& frame : frames) {
            database.run(
                "INSERT OR IGNORE INTO frames(job, place, frame, state, output, message) "
                "VALUES(?, ?, ?, ?, ?, ?)",
                job, place++, frame.frame, name_of(frame.state), frame.output, frame.message);
            if (frame.state == FrameState::quarantined)
                add_event(job, "quarantined",
                          {{"frame", frame.frame}, {"attempts", 0}, {"message", frame.message}});
        }
        database.run("UPDATE jobs SET begun = 1 WHERE id = ?", job);
        count_frames(database, job);
        add_event(job, "frames", {{"frames", frames.size()}});
    });
}

Status JobStore::frame_begins(const std::string& id, int frame) {
    return set(
        "UPDATE frames SET attempts = attempts + 1, begun = 1, in_flight = 1 WHERE job = ? AND "
        "frame = ? AND state = 'waiting'",
        number_of(id), frame);
}

Status JobStore::frame_ends(const std::string& id, const FrameEnd& end) {
    return change([&](Database& database) {
        const int64_t job = number_of(id);
        if (database.run("UPDATE frames SET state = ?, in_flight = 0, alone = 0, held = ?, message "
                         "= ?, filter_ms = ? WHERE job = ? AND frame = ? AND state = 'waiting'",
                         name_of(end.state), int(end.held), end.message, end.filter_ms, job,
                         end.frame) == 0)
            return;
        const bool good = end.state == FrameState::written || end.state == FrameState::skipped;
        database.run(
            "UPDATE jobs SET done = done + ?, failed = failed + ?, bytes = bytes + ? WHERE id = ?",
            int(good), int(!good), end.bytes, job);
        io::Json data = {{"frame", end.frame}, {"state", name_of(end.state)}};
        if (!end.message.empty()) data["message"] = end.message;
        if (end.state == FrameState::written) data["filter_ms"] = end.filter_ms;
        Statement counts(database, "SELECT frames, done, failed FROM jobs WHERE id = ?", job);
        counts.step();
        data["frames"] = counts.integer(0);
        data["done"] = counts.integer(1);
        data["failed"] = counts.integer(2);
        add_event(job, "frame", data);
    });
}

void JobStore::fail_frame(Database& database, int64_t job, int frame, const std::string& message) {
    if (database.run("UPDATE frames SET in_flight = 0, message = ?, state = CASE WHEN attempts "
                     ">= ? THEN 'quarantined' ELSE 'waiting' END WHERE job = ? AND frame = ? "
                     "AND state = 'waiting'",
                     message, attempts_, job, frame) == 0)
        return;
    Statement now(database, "SELECT state, attempts FROM frames WHERE job = ? AND frame = ?", job,
                  frame);
    now.step();
    const bool quarantined = now.text(0) == "quarantined";
    database.run("UPDATE jobs SET failed = failed + ? WHERE id = ?", int(quarantined), job);
    add_event(job, quarantined ? "quarantined" : "frame_failed",
              {{"frame", frame}, {"attempts", now.integer(1)}, {"message", message}});
}

Status JobStore::frame_fails(const std::string& id, int frame, const std::string& message) {
    return change([&](Database& database) { fail_frame(database, number_of(id), frame, message); });
}

Status JobStore::release(const std::string& id) {
    return set(
        "UPDATE frames SET attempts = MAX(attempts - 1, 0), in_flight = 0 WHERE job = ? AND "
        "in_flight = 1",
        number_of(id));
}

// ------------------------------------------------------------------------------ after a death
Status JobStore::interrupted(const std::string& id, const std::vector<int>& frames,
                             const std::string& message) {
    return change([&](Database& database) {
        const int64_t job = number_of(id);
        for (const int frame : frames)
            database.run(
                "UPDATE frames SET in_flight = 0, alone = 1, attempts = attempts - ? WHERE job = ? "
                "AND frame = ? AND in_flight = 1",
                int(frames.size() > 1), job, frame);
        if (frames.size() == 1) fail_frame(database, job, frames[0], message);
    });
}

// The jobs' processes died with the service, or go on in another queue: no attempt has failed.
void JobStore::recover(Database& database) {
    const auto running = all(Statement(database, "SELECT id FROM jobs WHERE state = 'running'"),
                             [](const Statement& row) { return row.integer(0); });
    for (const int64_t job : running) {
        database.run("UPDATE jobs SET state = 'queued' WHERE id = ?", job);
        add_event(job, "requeued", {{"why", "the service ended"}});
    }
    database.run(
        "UPDATE frames SET attempts = MAX(attempts - 1, 0), in_flight = 0 WHERE in_flight = 1");
}

}  // namespace postchain::service
