#include "tools/service/store/job_store.h"

#include <sqlite3.h>
#include <sys/stat.h>

#include "tools/sequence/files/json.h"
#include "tools/service/store/job_search.h"
#include "tools/service/store/rows.h"
#include "tools/service/store/upkeep.h"

namespace postchain::service {
namespace {

// Converts the exception that is being handled.
Status status_of(const std::string& path) {
    try {
        throw;
    } catch (const SqlError& error) {
        const int kind = error.code & 0xff;
        if (kind == SQLITE_BUSY || kind == SQLITE_LOCKED)
            return Status(StatusCode::output,
                          path + ": another program holds this store; end that program");
        if (kind == SQLITE_NOTADB)
            return Status(StatusCode::output,
                          path + ": is not a store of jobs; choose another file for the store");
        if (kind == SQLITE_CORRUPT)
            return Status(StatusCode::output,
                          path + ": the store is damaged (" + error.message +
                              "); move the file away, and the service creates a new one");
        if (kind == SQLITE_FULL)
            return Status(StatusCode::output, path + ": the disk is full; nothing was changed");
        return Status(StatusCode::output, path + ": the store cannot be used: " + error.message);
    } catch (const Status& refused) {
        return refused;
    } catch (...) {
        return status_of_exception(path);
    }
}

// Zeros if there is no file.
std::pair<dev_t, ino_t> identity_of(const std::string& path) {
    struct stat info = {};
    if (::stat(path.c_str(), &info) != 0) return {};
    return {info.st_dev, info.st_ino};
}

}  // namespace

JobStore::JobStore(const std::string& path, int attempts, const Retention& keep)
    : path_(path), attempts_(attempts), keep_(keep), database_(path) {}

template <class Work>
Status JobStore::change(const Work& work) {
    std::vector<Event> events;
    if (Status status = in_place(); !status.ok()) return status;
    try {
        const std::lock_guard lock(mutex_);
        said_.clear();
        Transaction transaction(database_);
        work();
        transaction.commit();
        events.swap(said_);
    } catch (...) {
        return status_of(path_);
    }
    const std::lock_guard lock(listener_mutex_);
    if (listener_)
        for (const Event& event : events) listener_(event);
    return Status();
}

template <class T, class Work>
Result<T> JobStore::look(const Work& work) const {
    try {
        const std::lock_guard lock(mutex_);
        return T(work());
    } catch (...) {
        return status_of(path_);
    }
}

Result<std::unique_ptr<JobStore>> JobStore::open(const std::string& path, int attempts,
                                                 const Retention& keep) {
    try {
        std::unique_ptr<JobStore> store(new JobStore(path, attempts, keep));
        if (Status status = store->lock_.take(path); !status.ok()) return status;
        prepare(store->database_, path);
        store->file_ = identity_of(path);
        if (Status status = store->change([&] {
                recover(store->database_, attempts,
                        [&](const std::string& id, const std::string& type,
                            const std::string& data) { store->add_event(id, type, data); });
            });
            !status.ok())
            return status;
        if (Status status = store->change([&] { prune(store->database_, keep); }); !status.ok())
            return status;
        return store;
    } catch (...) {
        return status_of(path);
    }
}

void JobStore::add_event(const std::string& id, const std::string& type, const std::string& data) {
    Event event{0, id, now_ms(), type, data};
    Statement(database_, "INSERT INTO events(job, time_ms, type, data) VALUES(?, ?, ?, ?)")
        .bind(number_of(id))
        .bind(event.time_ms)
        .bind(type)
        .bind(data)
        .run();
    event.id = database_.last_id();
    said_.push_back(std::move(event));
}

// For one more job of so many frames.
std::string JobStore::over_limit(int new_frames, const User& owner) {
    Statement used(database_,
                   "SELECT COUNT(*) FILTER (WHERE ended_ms = 0), SUM(frames - done - failed) "
                   "FILTER (WHERE ended_ms = 0), SUM(bytes) FROM jobs WHERE owner = ?");
    used.bind(owner.name).step();
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

Result<Added> JobStore::add(const NewJob& job, size_t max_queue, const User& owner) {
    Added added;
    const Status status = change([&] {
        if (!job.key.empty()) {
            Statement same(database_, concat(kJob, "WHERE key = ?").c_str());
            if (same.bind(job.key).step()) {
                added.job = job_of(same);
                added.what = added.job.body == job.body && added.job.owner == owner.name
                                 ? Added::What::same
                                 : Added::What::other_body;
                return;
            }
        }
        if (uint64_t(database_.number("SELECT COUNT(*) FROM jobs WHERE state = 'queued'")) >=
            max_queue) {
            added.what = Added::What::full;
            return;
        }
        added.why = over_limit(job.frames, owner);
        if (!added.why.empty()) {
            added.what = Added::What::over_limit;
            return;
        }
        Statement(database_,
                  "INSERT INTO jobs(kind, state, priority, body, key, created_ms, owner, frames) "
                  "VALUES(?, 'queued', ?, ?, ?, ?, ?, ?)")
            .bind(name_of(job.kind))
            .bind(job.priority)
            .bind(job.body)
            .bind(job.key)
            .bind(now_ms())
            .bind(owner.name)
            .bind(job.frames)
            .run();
        const std::string id = std::to_string(database_.last_id());
        add_event(id, "queued",
                  io::json_text({{"kind", name_of(job.kind)}, {"priority", job.priority}}));
        Statement made(database_, concat(kJob, "WHERE id = ?").c_str());
        made.bind(number_of(id)).step();
        added.job = job_of(made);
    });
    if (!status.ok()) return status;
    return added;
}

Result<std::optional<Job>> JobStore::job(const std::string& id) const {
    return look<std::optional<Job>>([&]() -> std::optional<Job> {
        Statement found(database_, concat(kJob, "WHERE id = ?").c_str());
        if (!found.bind(number_of(id)).step()) return std::nullopt;
        return job_of(found);
    });
}

Result<std::optional<Job>> JobStore::job_of_key(const std::string& key) const {
    return look<std::optional<Job>>([&]() -> std::optional<Job> {
        Statement found(database_, concat(kJob, "WHERE key = ? AND key <> ''").c_str());
        if (!found.bind(key).step()) return std::nullopt;
        return job_of(found);
    });
}

Result<std::vector<Job>> JobStore::jobs(const std::string& state, const std::string& before,
                                        size_t limit, const std::string& owner,
                                        const std::string& search) const {
    return look<std::vector<Job>>([&] {
        std::vector<Job> jobs;
        const auto words = words_of(search);
        Statement found(database_,
                        concat(kJob,
                               "WHERE (?1 = '' OR state = ?1) AND (?2 = 0 OR id < ?2) "
                               "AND (?4 = '' OR owner = ?4)",
                               search_condition(words.size(), 5), " ORDER BY id DESC LIMIT ?3")
                            .c_str());
        // No jobs are older than an invalid id.
        found.bind(state).bind(before.empty() ? 0 : std::max<int64_t>(number_of(before), 1));
        found.bind(int64_t(limit)).bind(owner);
        for (const std::string& word : words) found.bind(word);
        while (found.step()) jobs.push_back(job_of(found));
        return jobs;
    });
}

Result<QueuePlaces> JobStore::places() const {
    return look<QueuePlaces>([&] {
        std::vector<WaitingJob> waiting;
        Statement found(database_,
                        "SELECT id, priority, owner, IFNULL((SELECT turn FROM turns WHERE "
                        "turns.owner = jobs.owner), 0) FROM jobs WHERE state = 'queued'");
        while (found.step())
            waiting.push_back(
                {found.integer(0), int(found.integer(1)), found.text(2), found.integer(3)});
        return places_of(waiting);
    });
}

Result<std::vector<JobFrame>> JobStore::frames(const std::string& id) const {
    return look<std::vector<JobFrame>>([&] {
        std::vector<JobFrame> frames;
        Statement found(database_, concat(kFrame, "WHERE job = ? ORDER BY place").c_str());
        found.bind(number_of(id));
        while (found.step()) frames.push_back(frame_of(found));
        return frames;
    });
}

Result<std::optional<JobFrame>> JobStore::frame(const std::string& id, int frame) const {
    return look<std::optional<JobFrame>>([&]() -> std::optional<JobFrame> {
        Statement found(database_, concat(kFrame, "WHERE job = ? AND frame = ?").c_str());
        if (!found.bind(number_of(id)).bind(frame).step()) return std::nullopt;
        return frame_of(found);
    });
}

Result<std::vector<Event>> JobStore::events(const std::string& id, int64_t after,
                                            size_t limit) const {
    return look<std::vector<Event>>([&] {
        std::vector<Event> events;
        Statement found(database_, id.empty()
                                       ? "SELECT id, job, time_ms, type, data FROM events WHERE "
                                         "?1 = 0 AND id > ?2 ORDER BY id LIMIT ?3"
                                       : "SELECT id, job, time_ms, type, data FROM events WHERE "
                                         "job = ?1 AND id > ?2 ORDER BY id LIMIT ?3");
        found.bind(id.empty() ? 0 : number_of(id)).bind(after).bind(int64_t(limit));
        while (found.step())
            events.push_back(
                {found.integer(0), found.text(1), found.integer(2), found.text(3), found.text(4)});
        return events;
    });
}

std::map<JobState, size_t> JobStore::counts() const {
    const auto counts = look<std::map<JobState, size_t>>([&] {
        std::map<JobState, size_t> found;
        Statement states(database_, "SELECT state, COUNT(*) FROM jobs GROUP BY state");
        while (states.step()) found[state_of(states.text(0))] = size_t(states.integer(1));
        return found;
    });
    return counts.ok() ? *counts : std::map<JobState, size_t>();
}

Status JobStore::in_place() const {
    const bool lost = identity_of(path_) != file_;
    const Status status = lost ? Status(StatusCode::output,
                                        path_ +
                                            ": the store was removed or replaced while the service "
                                            "runs; nothing is recorded; put the file back, or "
                                            "restart the service")
                               : Status();
    const std::lock_guard lock(loss_mutex_);
    if (lost && !lost_ && loss_listener_) loss_listener_(status.message());
    lost_ = lost;
    return status;
}

void JobStore::on_loss(std::function<void(const std::string&)> listener) {
    const std::lock_guard lock(loss_mutex_);
    loss_listener_ = std::move(listener);
}

void JobStore::on_event(std::function<void(const Event&)> listener) {
    const std::lock_guard lock(listener_mutex_);
    listener_ = std::move(listener);
}

Result<std::optional<Job>> JobStore::next(int above) const {
    return look<std::optional<Job>>([&]() -> std::optional<Job> {
        Statement found(database_, concat(kJob,
                                          "WHERE state = 'queued' AND priority >= ? ORDER BY "
                                          "priority DESC, IFNULL((SELECT turn FROM turns WHERE "
                                          "turns.owner = jobs.owner), 0), id LIMIT 1")
                                       .c_str());
        if (!found.bind(above).step()) return std::nullopt;
        return job_of(found);
    });
}

Result<int> JobStore::start(const std::string& id) {
    int attempts = 0;
    const Status status = change([&] {
        Statement(database_,
                  "UPDATE jobs SET state = 'running', attempts = attempts + 1, started_ms = CASE "
                  "started_ms WHEN 0 THEN ? ELSE started_ms END WHERE id = ? AND state = 'queued'")
            .bind(now_ms())
            .bind(number_of(id))
            .run();
        if (database_.changes() == 0) return;
        Statement(database_,
                  "INSERT OR REPLACE INTO turns(owner, turn) SELECT owner, (SELECT "
                  "IFNULL(MAX(turn), 0) + 1 FROM turns) FROM jobs WHERE id = ?")
            .bind(number_of(id))
            .run();
        add_event(id, "started", "{}");
        Statement now(database_, "SELECT attempts FROM jobs WHERE id = ?");
        now.bind(number_of(id)).step();
        attempts = int(now.integer(0));
    });
    if (!status.ok()) return status;
    return attempts;
}

Status JobStore::enter_frames(const std::string& id, const std::vector<JobFrame>& frames) {
    return change([&] {
        int64_t place = 0;
        for (const JobFrame& frame : frames)
            Statement(database_,
                      "INSERT OR IGNORE INTO frames(job, place, frame, state, output, message) "
                      "VALUES(?, ?, ?, ?, ?, ?)")
                .bind(number_of(id))
                .bind(place++)
                .bind(frame.frame)
                .bind(name_of(frame.state))
                .bind(frame.output)
                .bind(frame.message)
                .run();
        Statement(database_, "UPDATE jobs SET begun = 1 WHERE id = ?").bind(number_of(id)).run();
        count_frames(database_, number_of(id));
        add_event(id, "frames", io::json_text({{"frames", frames.size()}}));
    });
}

Result<FrameTally> JobStore::tally(const std::string& id) const {
    return look<FrameTally>([&] {
        FrameTally tally;
        Statement found(database_,
                        "SELECT frame, state, held FROM frames WHERE job = ? AND (state NOT IN "
                        "('written', 'skipped') OR held = 1) ORDER BY place");
        found.bind(number_of(id));
        while (found.step()) {
            const std::string state = found.text(1);
            if (state == "waiting") ++tally.waiting;
            if (state == "missing") ++tally.missing;
            if (state == "quarantined") tally.quarantined.push_back(int(found.integer(0)));
            if (found.integer(2) != 0) ++tally.held;
        }
        return tally;
    });
}

Result<std::vector<FrameToDo>> JobStore::to_do(const std::string& id) const {
    return look<std::vector<FrameToDo>>([&] {
        std::vector<FrameToDo> frames;
        Statement found(database_,
                        "SELECT frame, attempts, begun, alone FROM frames WHERE job = ? AND state "
                        "= 'waiting' ORDER BY place");
        found.bind(number_of(id));
        while (found.step())
            frames.push_back({int(found.integer(0)), int(found.integer(1)), found.integer(2) != 0,
                              found.integer(3) != 0});
        return frames;
    });
}

Result<bool> JobStore::has_begun(const std::string& id) const {
    return look<bool>([&] {
        Statement found(database_, "SELECT begun FROM jobs WHERE id = ?");
        return found.bind(number_of(id)).step() && found.integer(0) != 0;
    });
}

Status JobStore::began(const std::string& id) {
    return change([&] {
        Statement(database_, "UPDATE jobs SET begun = 1 WHERE id = ?").bind(number_of(id)).run();
    });
}

Status JobStore::frame_begins(const std::string& id, int frame) {
    return change([&] {
        Statement(database_,
                  "UPDATE frames SET attempts = attempts + 1, begun = 1, in_flight = 1 WHERE job = "
                  "? AND frame = ? AND state = 'waiting'")
            .bind(number_of(id))
            .bind(frame)
            .run();
    });
}

Status JobStore::frame_ends(const std::string& id, const FrameEnd& end) {
    return change([&] {
        const int64_t job = number_of(id);
        Statement(database_,
                  "UPDATE frames SET state = ?, in_flight = 0, alone = 0, held = ?, message = ?, "
                  "filter_ms = ? WHERE job = ? AND frame = ? AND state = 'waiting'")
            .bind(name_of(end.state))
            .bind(end.held ? 1 : 0)
            .bind(end.message)
            .bind(end.filter_ms)
            .bind(job)
            .bind(end.frame)
            .run();
        if (database_.changes() == 0) return;
        const bool good = end.state == FrameState::written || end.state == FrameState::skipped;
        Statement(database_,
                  "UPDATE jobs SET attempts = 0, done = done + ?, failed = failed + ?, bytes = "
                  "bytes + ? WHERE id = ?")
            .bind(good ? 1 : 0)
            .bind(good ? 0 : 1)
            .bind(end.bytes)
            .bind(job)
            .run();
        io::Json data = {{"frame", end.frame}, {"state", name_of(end.state)}};
        if (!end.message.empty()) data["message"] = end.message;
        if (end.state == FrameState::written) data["filter_ms"] = end.filter_ms;
        Statement counts(database_, "SELECT frames, done, failed FROM jobs WHERE id = ?");
        counts.bind(job).step();
        data["frames"] = counts.integer(0);
        data["done"] = counts.integer(1);
        data["failed"] = counts.integer(2);
        add_event(id, "frame", io::json_text(data));
    });
}

Status JobStore::frame_fails(const std::string& id, int frame, const std::string& message) {
    return change([&] {
        const int64_t job = number_of(id);
        Statement(database_,
                  "UPDATE frames SET in_flight = 0, message = ?, state = CASE WHEN attempts >= ? "
                  "THEN 'quarantined' ELSE 'waiting' END WHERE job = ? AND frame = ? AND state = "
                  "'waiting'")
            .bind(message)
            .bind(attempts_)
            .bind(job)
            .bind(frame)
            .run();
        if (database_.changes() == 0) return;
        Statement now(database_, "SELECT state, attempts FROM frames WHERE job = ? AND frame = ?");
        now.bind(job).bind(frame).step();
        const bool quarantined = now.text(0) == "quarantined";
        Statement(database_, quarantined
                                 ? "UPDATE jobs SET attempts = 0, failed = failed + 1 WHERE id = ?"
                                 : "UPDATE jobs SET attempts = 0 WHERE id = ?")
            .bind(job)
            .run();
        add_event(
            id, quarantined ? "quarantined" : "frame_failed",
            io::json_text({{"frame", frame}, {"attempts", now.integer(1)}, {"message", message}}));
    });
}

Status JobStore::release(const std::string& id) {
    return change([&] {
        Statement(database_,
                  "UPDATE frames SET attempts = MAX(attempts - 1, 0), in_flight = 0 WHERE job = ? "
                  "AND in_flight = 1")
            .bind(number_of(id))
            .run();
    });
}

Status JobStore::requeue(const std::string& id, const std::string& why, bool counts) {
    return change([&] {
        Statement(database_,
                  "UPDATE jobs SET state = 'queued', attempts = CASE ? WHEN 0 THEN 0 ELSE attempts "
                  "END WHERE id = ? AND state = 'running'")
            .bind(counts ? 1 : 0)
            .bind(number_of(id))
            .run();
        if (database_.changes() > 0) add_event(id, "requeued", io::json_text({{"why", why}}));
    });
}

Status JobStore::end(const Job& job) {
    const Status status = change([&] {
        Statement(database_,
                  "UPDATE jobs SET state = ?, message = ?, exit_code = ?, verdict = ?, ended_ms = "
                  "?, attempts = 0 WHERE id = ? AND state = 'running'")
            .bind(name_of(job.state))
            .bind(job.message)
            .bind(job.exit_code)
            .bind(job.verdict)
            .bind(now_ms())
            .bind(number_of(job.id))
            .run();
        if (database_.changes() == 0) return;
        io::Json data = {{"exit_code", job.exit_code}};
        if (!job.message.empty()) data["message"] = job.message;
        if (!job.verdict.empty()) data["verdict"] = job.verdict;
        add_event(job.id, name_of(job.state), io::json_text(data));
    });
    // If pruning fails, the next end() prunes.
    if (status.ok()) (void)change([&] { prune(database_, keep_); });
    return status;
}

Result<bool> JobStore::cancel(const std::string& id) {
    bool done = false;
    const Status status = change([&] {
        Statement(database_,
                  "UPDATE jobs SET state = 'canceled', message = 'canceled', ended_ms = ? WHERE id "
                  "= ? AND state IN ('queued', 'running')")
            .bind(now_ms())
            .bind(number_of(id))
            .run();
        done = database_.changes() > 0;
        if (done) add_event(id, "canceled", "{}");
    });
    if (!status.ok()) return status;
    return done;
}

Result<Retried> JobStore::retry(const std::string& id, const User& owner) {
    Retried retried;
    const Status status = change([&] {
        const int64_t job = number_of(id);
        Statement ended(database_,
                        "SELECT frames - done FROM jobs WHERE id = ? AND state IN ('failed', "
                        "'canceled')");
        if (!ended.bind(job).step()) return;
        retried.why = over_limit(int(ended.integer(0)), owner);
        if (!retried.why.empty()) return;
        Statement(database_,
                  "UPDATE jobs SET state = 'queued', message = '', exit_code = 0, verdict = '', "
                  "ended_ms = 0, attempts = 0 WHERE id = ?")
            .bind(job)
            .run();
        retried.done = true;
        Statement(database_,
                  "UPDATE frames SET state = 'waiting', attempts = 0, message = '' WHERE job = ? "
                  "AND state IN ('quarantined', 'missing', 'waiting')")
            .bind(job)
            .run();
        count_frames(database_, job);
        add_event(id, "requeued", io::json_text({{"why", "asked for"}}));
    });
    if (!status.ok()) return status;
    return retried;
}

Result<bool> JobStore::set_priority(const std::string& id, int priority) {
    bool done = false;
    const Status status = change([&] {
        Statement(database_,
                  "UPDATE jobs SET priority = ? WHERE id = ? AND state IN ('queued', 'running')")
            .bind(priority)
            .bind(number_of(id))
            .run();
        done = database_.changes() > 0;
        if (done) add_event(id, "priority", io::json_text({{"priority", priority}}));
    });
    if (!status.ok()) return status;
    return done;
}

Result<bool> JobStore::forget(const std::string& id) {
    bool done = false;
    const Status status = change([&] {
        Statement(database_,
                  "DELETE FROM jobs WHERE id = ? AND state IN ('done', 'failed', 'canceled') AND "
                  "remote = ''")
            .bind(number_of(id))
            .run();
        done = database_.changes() > 0;
    });
    if (!status.ok()) return status;
    return done;
}

Result<std::string> JobStore::remote(const std::string& id) const {
    return look<std::string>([&] {
        Statement found(database_, "SELECT remote FROM jobs WHERE id = ?");
        return found.bind(number_of(id)).step() ? found.text(0) : std::string();
    });
}

Result<std::vector<std::pair<Job, std::string>>> JobStore::remotes() const {
    return look<std::vector<std::pair<Job, std::string>>>([&] {
        std::vector<std::pair<Job, std::string>> jobs;
        std::string query = kJob;
        query.replace(query.find(" FROM"), 0, ", remote");
        // A queued one follows when it has started again.
        Statement found(database_,
                        (query + "WHERE remote <> '' AND state <> 'queued' ORDER BY id").c_str());
        while (found.step()) jobs.emplace_back(job_of(found), found.text(16));
        return jobs;
    });
}

Status JobStore::set_remote(const std::string& id, const std::string& remote) {
    return change([&] {
        Statement(database_, "UPDATE jobs SET remote = ? WHERE id = ?")
            .bind(remote)
            .bind(number_of(id))
            .run();
    });
}

QueueTimes JobStore::times() const {
    const auto times = look<QueueTimes>([&] {
        QueueTimes found;
        Statement oldest(database_,
                         "SELECT MIN(created_ms), COUNT(*) FROM jobs WHERE state = 'queued'");
        if (oldest.step() && oldest.integer(1) > 0) found.oldest_queued_ms = oldest.integer(0);
        for (const char* suffix : {"", "-wal"}) {
            struct stat info = {};
            if (::stat((path_ + suffix).c_str(), &info) == 0) found.store_bytes += info.st_size;
        }
        return found;
    });
    return times.ok() ? *times : QueueTimes();
}

Status JobStore::say(const std::string& id, const std::string& type, const std::string& data) {
    return change([&] { add_event(id, type, data); });
}

}  // namespace postchain::service
