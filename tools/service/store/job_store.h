// The store of jobs: one SQLite file in WAL mode that outlives the process (store_file.h).
//
//   add --> queued --start--> running --end--> done, failed, canceled
//              ^                 |
//              +--- requeue, or the process ended ---+
#pragma once

#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "tools/service/store/store_file.h"
#include "tools/service/store/users.h"

namespace postchain::service {

// An unfinished frame.
struct FrameToDo {
    int frame = 0;
    int attempts = 0;
    bool begun = false;  // at least once: this job may have written its output
    bool alone = false;  // it was in flight when a process died, so it runs alone
};

// The end of a frame.
struct FrameEnd {
    int frame = 0;
    FrameState state = FrameState::written;
    std::string message;  // warnings
    bool held = false;    // the output is another frame's image
    double filter_ms = 0;
    int64_t bytes = 0;  // of the output
};

// A job's frames, counted by state.
struct FrameTally {
    int waiting = 0, held = 0, missing = 0;
    std::vector<int> quarantined;
    std::string reason;  // of the first of them
};

struct NewJob {
    JobKind kind = JobKind::run;
    std::string body;
    int priority = 0;
    std::string key = {};     // may be empty
    int frames = 0;           // 0 = not known yet
    std::string output = {};  // the pattern or folder that it writes, resolved; empty = not known
    std::string about = "{}";
    std::string writes = {};  // every pattern and folder that it writes, a line for each
};

struct Added {
    enum class Result { made, same, other_body, full, over_limit };
    Result result = Result::made;
    Job job;          // if made, same, other_body
    std::string why;  // full, over_limit
};

// Bytes in the outputs of an owner's removed jobs that write to the same place.
struct LedgerEntry {
    std::string writes;  // NewJob::writes
    int64_t bytes = 0;
};

// For /metrics.
struct StoreUse {
    std::map<JobState, size_t> jobs;
    int64_t oldest_queued_ms = 0;          // its submission; 0 = none waits
    std::map<std::string, int64_t> bytes;  // of each owner with a name, in the ledger too
};

struct Retried {
    bool done = false;  // false: over a limit, or neither failed nor canceled
    std::string why;    // the queue's or the owner's limit
};

using QueuePlaces = std::map<std::string, int>;  // by id, from 1

class JobStore final : public StoreFile {
  public:
    // `attempts`: per frame, and per job that dies before its first frame. Errors (output): as of
    // StoreFile::take().
    static Result<std::unique_ptr<JobStore>> open(const std::string& path, int attempts,
                                                  const Retention& keep = {});

    // Result `full` if `max_queue` jobs wait.
    Result<Added> add(const NewJob& job, size_t max_queue, const User& owner = User());
    Result<std::optional<Job>> job(const std::string& id) const;
    Result<std::optional<Job>> listed(const std::string& id) const;  // without its body
    Result<std::optional<Job>> job_of_key(const std::string& key) const;
    // Without their bodies, newest first; `state`, `before`, `owner` and `search` may be empty.
    // `search`: words that all occur in a job's id, kind, state, owner, message, paths or chains,
    // in any case (ASCII).
    Result<std::vector<Job>> jobs(const std::string& state, const std::string& before, size_t limit,
                                  const std::string& owner = "",
                                  const std::string& search = "") const;
    // Unfinished jobs with this NewJob::output, oldest first.
    Result<std::vector<Job>> writers(const std::string& output) const;
    // The places of waiting jobs, in the order in which next() would return them.
    Result<QueuePlaces> places() const;
    Result<std::vector<Event>> events(const std::string& id, int64_t after, size_t limit) const;
    Result<int64_t> newest_event() const;  // its id, removed or not; 0 = none yet
    StoreUse use() const;                  // empty on failure

    // Without its body: the queued job with the highest priority, at least `above`. Among equals
    // the one whose owner had its turn longest ago; then the oldest. Without the jobs of some
    // owners.
    Result<std::optional<Job>> next(int above, const std::vector<std::string>& without = {}) const;
    // Sets the job running; false if it is no longer queued.
    Result<bool> start(const std::string& id);
    // Sets Job::begun of an ab, bench or study, as enter_frames() does for a run.
    Status began(const std::string& id);

    // Queues a running job again.
    Status requeue(const std::string& id, const std::string& why);
    // Reads id, state, message, exit_code and verdict of `job`.
    Status end(const Job& job);
    // The size of what an ab, bench or study has written so far.
    Status has_written(const std::string& id, int64_t bytes);
    // Cancels a queued or running job; false for other states.
    Result<bool> cancel(const std::string& id, int exit_code = 0);
    // Queues the unfinished frames of a failed or canceled job, within the limits of its owner and
    // of waiting jobs.
    Result<Retried> retry(const std::string& id, const User& owner = User(),
                          size_t max_queue = std::numeric_limits<size_t>::max());
    // Changes the priority of an unfinished job; false for other states.
    Result<bool> set_priority(const std::string& id, int priority);
    // Removes an ended job with its frames and events; false for other states, and while it has
    // tasks in another queue. Its outputs count for its owner until settle().
    Result<bool> forget(const std::string& id);
    // Why the owner's jobs may write no more (max_disk); empty = they may.
    Result<std::string> over_disk(const User& owner) const;
    Result<std::vector<LedgerEntry>> ledger(const std::string& owner) const;
    // An entry has at most this many bytes on disk; without any it is removed.
    Status settle(const std::string& owner, const std::string& writes, int64_t bytes);
    // Every job with Job::remote, ended ones too, without their bodies.
    Result<std::vector<Job>> remotes() const;
    Status set_remote(const std::string& id, const std::string& remote);
    // Adds an event of a running job without changing its state.
    Status say(const std::string& id, const std::string& type, const io::Json& data);

    // A frame is recorded as begun before its first file is opened. If the process dies, the next
    // one finds the begun frames: docs/service.md, "After a crash". Frames are in the order of the
    // job.
    // At most `limit`, from the place `from` (0 = the first).
    Result<std::vector<JobFrame>> frames(const std::string& id, size_t from = 0,
                                         size_t limit = std::numeric_limits<int>::max()) const;
    Result<std::optional<JobFrame>> frame(const std::string& id, int frame) const;
    Result<FrameTally> tally(const std::string& id) const;
    Result<std::vector<FrameToDo>> to_do(const std::string& id) const;

    // Records the frames at the first start of the job. Later calls change nothing.
    Status enter_frames(const std::string& id, const std::vector<JobFrame>& frames);
    Status frame_begins(const std::string& id, int frame);
    Status frame_ends(const std::string& id, const FrameEnd& end);
    // The frame waits again, or is quarantined after the last attempt.
    Status frame_fails(const std::string& id, int frame, const std::string& message);
    // After a stop: interrupted frames wait again, without a counted attempt.
    Status release(const std::string& id);
    // After the death of a process that worked on the job: the frames that it had under way run
    // alone from now on. If it was one, its attempt has failed; of several none is counted.
    Status interrupted(const std::string& id, const std::vector<int>& frames,
                       const std::string& message);

  private:
    JobStore(const std::string& path, int attempts, const Retention& keep)
        : StoreFile(path), attempts_(attempts), keep_(keep) {}
    // Within a change.
    void prune(Database& database);
    void add_end(Database& database, int64_t job, JobState state, const io::Json& data);
    void fail_frame(Database& database, int64_t job, int frame, const std::string& message);
    void recover(Database& database);  // docs/service.md, "After a crash"

    const int attempts_;  // of a frame
    const Retention keep_;
};

}  // namespace postchain::service
