#include "tools/service/store/job_store.h"

#include <algorithm>

#include "tools/service/store/job_search.h"
#include "tools/service/store/rows.h"

namespace postchain::service {
namespace {

// The reason that the owner may not have one more job of `new_frames`; empty = they may.
std::string over_limit(Database& database, int new_frames, const User& owner) {
    Statement used(database,
                   "SELECT COUNT(*) FILTER (WHERE ended_ms = 0), SUM(frames - done - failed) "
                   "FILTER (WHERE ended_ms = 0), SUM(bytes) FROM jobs WHERE owner = ?",
                   owner.name);
    used.step();
    const int64_t jobs = used.integer(0) + 1, frames = used.integer(1) + new_frames;
    if (owner.max_jobs > 0 && jobs > owner.max_jobs)
        return concat(owner.name, " may have ", owner.max_jobs,
                      " unfinished jobs; wait until one has ended, or cancel one");
    if (owner.max_frames > 0 && frames > owner.max_frames)
        return concat(owner.name, " may have ", owner.max_frames,
                      " frames in unfinished jobs, and would have ", frames,
                      "; submit fewer, or wait");
    if (owner.max_bytes > 0 && used.integer(2) >= owner.max_bytes)
        return concat("the jobs of ", owner.name, " have written ", used.integer(2),
                      " bytes, the limit is ", owner.max_disk,
                      "; delete outputs that are not needed, and their jobs");
    return "";
}

bool is_full(Database& database, size_t max_queue) {
    return uint64_t(database.number("SELECT COUNT(*) FROM jobs WHERE state = 'queued'")) >=
           max_queue;
}

std::string full_text(size_t max_queue) {
    return concat(max_queue, " jobs are waiting; try again later");
}

template <class... Values>
std::optional<Job> job_where(Database& database, const char* where, const Values&... values) {
    return first(Statement(database, concat(kJob, "WHERE ", where), values...), job_of);
}

}  // namespace

Result<std::unique_ptr<JobStore>> JobStore::open(const std::string& path, int attempts,
                                                 const Retention& keep) {
    std::unique_ptr<JobStore> store(new JobStore(path, attempts, keep));
    Status status = store->take();
    if (status.ok())
        status = store->change([&](Database& database) {
            recover(database, attempts,
                    [&](int64_t job, const std::string& type, const io::Json& data) {
                        store->add_event(job, type, data);
                    });
        });
    if (status.ok()) status = store->change([&](Database& database) { prune(database, keep); });
    if (!status.ok()) return status;
    return store;
}

Result<Added> JobStore::add(const NewJob& job, size_t max_queue, const User& owner) {
    return change([&](Database& database) {
        if (!job.key.empty())
            if (auto same = job_where(database, "key = ?", job.key)) {
                const bool equal = same->body == job.body && same->owner == owner.name;
                return Added{equal ? Added::What::same : Added::What::other_body, *same, ""};
            }
        if (is_full(database, max_queue)) return Added{Added::What::full, {}, full_text(max_queue)};
        if (auto why = over_limit(database, job.frames, owner); !why.empty())
            return Added{Added::What::over_limit, {}, why};
        database.run(
            "INSERT INTO jobs(kind, state, priority, body, key, created_ms, owner, frames) "
            "VALUES(?, 'queued', ?, ?, ?, ?, ?, ?)",
            name_of(job.kind), job.priority, job.body, job.key, now_ms(), owner.name, job.frames);
        const int64_t id = database.last_id();
        add_event(id, "queued", {{"kind", name_of(job.kind)}, {"priority", job.priority}});
        return Added{Added::What::made, *job_where(database, "id = ?", id), ""};
    });
}

Result<std::optional<Job>> JobStore::job(const std::string& id) const {
    return look([&](Database& database) { return job_where(database, "id = ?", number_of(id)); });
}

Result<std::optional<Job>> JobStore::job_of_key(const std::string& key) const {
    return look(
        [&](Database& database) { return job_where(database, "key = ? AND key <> ''", key); });
}

Result<std::vector<Job>> JobStore::jobs(const std::string& state, const std::string& before,
                                        size_t limit, const std::string& owner,
                                        const std::string& search) const {
    return look([&](Database& database) {
        const auto words = words_of(search);
        // No jobs are older than an invalid id.
        const int64_t last = before.empty() ? 0 : std::max<int64_t>(number_of(before), 1);
        return all(
            Statement(database,
                      concat(kJob,
                             "WHERE (?1 = '' OR state = ?1) AND (?2 = 0 OR id < ?2) AND (?4 "
                             "= '' OR owner = ?4)",
                             search_condition(words.size(), 5), " ORDER BY id DESC LIMIT ?3"),
                      state, last, int64_t(limit), owner, words),
            job_of);
    });
}

Result<QueuePlaces> JobStore::places() const {
    return look([&](Database& database) {
        const auto waiting_of = [](const Statement& row) {
            return WaitingJob{row.integer(0), int(row.integer(1)), row.text(2), row.integer(3)};
        };
        return places_of(
            all(Statement(database,
                          "SELECT id, priority, owner, IFNULL((SELECT turn FROM turns "
                          "WHERE turns.owner = jobs.owner), 0) FROM jobs WHERE state = "
                          "'queued'"),
                waiting_of));
    });
}

Result<std::vector<Event>> JobStore::events(const std::string& id, int64_t after,
                                            size_t limit) const {
    return look([&](Database& database) {
        return all(
            Statement(
                database,
                concat("SELECT id, job, time_ms, type, data FROM events WHERE ",
                       id.empty() ? "?1 = 0" : "job = ?1", " AND id > ?2 ORDER BY id LIMIT ?3"),
                id.empty() ? 0 : number_of(id), after, int64_t(limit)),
            [](const Statement& row) {
                return Event{row.integer(0), row.text(1), row.integer(2), row.text(3), row.text(4)};
            });
    });
}

std::map<JobState, size_t> JobStore::counts() const {
    const auto counts = look([&](Database& database) {
        std::map<JobState, size_t> found;
        Statement states(database, "SELECT state, COUNT(*) FROM jobs GROUP BY state");
        while (states.step()) found[state_of(states.text(0))] = size_t(states.integer(1));
        return found;
    });
    return counts.ok() ? *counts : std::map<JobState, size_t>();
}

QueueTimes JobStore::times() const {
    QueueTimes times;
    times.store_bytes = bytes();
    const auto oldest = look([&](Database& database) {
        return database.number("SELECT MIN(created_ms) FROM jobs WHERE state = 'queued'");
    });
    if (oldest.ok() && *oldest > 0) times.oldest_queued_ms = *oldest;
    return times;
}

Result<std::optional<Job>> JobStore::next(int above) const {
    return look([&](Database& database) {
        return job_where(database,
                         "state = 'queued' AND priority >= ? ORDER BY priority DESC, "
                         "IFNULL((SELECT turn FROM turns WHERE turns.owner = jobs.owner), 0), id "
                         "LIMIT 1",
                         above);
    });
}

Result<int> JobStore::start(const std::string& id) {
    return change([&](Database& database) {
        const int64_t job = number_of(id);
        if (database.run("UPDATE jobs SET state = 'running', attempts = attempts + 1, started_ms = "
                         "CASE started_ms WHEN 0 THEN ? ELSE started_ms END WHERE id = ? AND state "
                         "= 'queued'",
                         now_ms(), job) == 0)
            return 0;
        database.run(
            "INSERT OR REPLACE INTO turns(owner, turn) SELECT owner, (SELECT IFNULL(MAX(turn), 0) "
            "+ 1 FROM turns) FROM jobs WHERE id = ?",
            job);
        add_event(job, "started");
        return int(database.number("SELECT attempts FROM jobs WHERE id = ?", job));
    });
}

Result<bool> JobStore::has_begun(const std::string& id) const {
    return look([&](Database& database) {
        return database.number("SELECT begun FROM jobs WHERE id = ?", number_of(id)) != 0;
    });
}

Status JobStore::began(const std::string& id) {
    return change([&](Database& database) {
        database.run("UPDATE jobs SET begun = 1 WHERE id = ?", number_of(id));
    });
}

Status JobStore::requeue(const std::string& id, const std::string& why, bool counts) {
    return change([&](Database& database) {
        if (database.run("UPDATE jobs SET state = 'queued', attempts = CASE ? WHEN 0 THEN 0 ELSE "
                         "attempts END WHERE id = ? AND state = 'running'",
                         int(counts), number_of(id)) > 0)
            add_event(number_of(id), "requeued", {{"why", why}});
    });
}

Status JobStore::end(const Job& job) {
    const Status status = change([&](Database& database) {
        const int64_t id = number_of(job.id);
        if (database.run("UPDATE jobs SET state = ?, message = ?, exit_code = ?, verdict = ?, "
                         "ended_ms = ?, attempts = 0, done = CASE WHEN kind <> 'run' AND ?1 = "
                         "'done' THEN frames ELSE done END WHERE id = ? AND state = 'running'",
                         name_of(job.state), job.message, job.exit_code, job.verdict, now_ms(),
                         id) == 0)
            return;
        io::Json data = {{"exit_code", job.exit_code}};
        if (!job.message.empty()) data["message"] = job.message;
        if (!job.verdict.empty()) data["verdict"] = job.verdict;
        add_event(id, name_of(job.state), data);
    });
    // If pruning fails, the next end() prunes.
    if (status.ok()) (void)change([&](Database& database) { prune(database, keep_); });
    return status;
}

Status JobStore::has_written(const std::string& id, int64_t bytes) {
    return change([&](Database& database) {
        database.run("UPDATE jobs SET bytes = ? WHERE id = ?", bytes, number_of(id));
    });
}

Result<bool> JobStore::cancel(const std::string& id, int exit_code) {
    return change([&](Database& database) {
        const int64_t job = number_of(id);
        const bool done =
            database.run(
                "UPDATE jobs SET state = 'canceled', message = 'canceled', exit_code = ?, ended_ms "
                "= ? WHERE id = ? AND state IN ('queued', 'running')",
                exit_code, now_ms(), job) > 0;
        if (done) add_event(job, "canceled");
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
        if (auto why = over_limit(database, int(ended.integer(0)), owner); !why.empty())
            return Retried{false, why};
        database.run(
            "UPDATE jobs SET state = 'queued', message = '', exit_code = 0, verdict = '', ended_ms "
            "= 0, attempts = 0 WHERE id = ?",
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
    return change([&](Database& database) {
        return database.run(
                   "DELETE FROM jobs WHERE id = ? AND state IN ('done', 'failed', "
                   "'canceled') AND remote = ''",
                   number_of(id)) > 0;
    });
}

Result<std::string> JobStore::remote(const std::string& id) const {
    return look([&](Database& database) {
        return database.text("SELECT remote FROM jobs WHERE id = ?", number_of(id));
    });
}

Result<std::vector<std::pair<Job, std::string>>> JobStore::remotes() const {
    return look([&](Database& database) {
        std::string query = kJob;
        query.replace(query.find(" FROM"), 0, ", remote");
        // A queued one follows when it has started again.
        return all(
            Statement(database, query + "WHERE remote <> '' AND state <> 'queued' ORDER BY id"),
            [](const Statement& row) { return std::pair(job_of(row), row.text(16)); });
    });
}

Status JobStore::set_remote(const std::string& id, const std::string& remote) {
    return change([&](Database& database) {
        database.run("UPDATE jobs SET remote = ? WHERE id = ?", remote, number_of(id));
    });
}

Status JobStore::say(const std::string& id, const std::string& type, const io::Json& data) {
    return change([&](Database&) { add_event(number_of(id), type, data); });
}

}  // namespace postchain::service
