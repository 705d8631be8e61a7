// The store of jobs: one SQLite file in WAL mode that outlives the process.
//
//   add --> queued --start--> running --end--> done, failed, canceled
//              ^                 |
//              +--- requeue, or the process ended ---+
//
// Each state change and its event are one transaction, which is on disk (synchronous=FULL) before
// the call returns. A successful call is never lost, and a failed call changes nothing. One process
// at a time uses the file. If the file is removed or replaced, every change is refused: it would be
// in no file. Thread-safe.
//
// A frame is recorded as begun before its first file is opened. If the process dies, the next
// open() finds the begun frames: docs/service.md, "After a crash".
#pragma once

#include <sys/types.h>

#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "chain/status.h"
#include "tools/service/store/job.h"
#include "tools/service/store/queue_order.h"
#include "tools/service/store/sqlite.h"
#include "tools/service/store/store_lock.h"
#include "tools/service/store/upkeep.h"
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
};

struct NewJob {
    JobKind kind = JobKind::run;
    std::string body;
    int priority = 0;
    std::string key = {};  // may be empty
    int frames = 0;        // 0 = not known yet
};

struct Added {
    enum class What { made, same, other_body, full, over_limit };
    What what = What::made;
    Job job;          // if made, same, other_body
    std::string why;  // over_limit: the user's limit
};

struct Retried {
    bool done = false;  // false: over the limit, or neither failed nor canceled
    std::string why;    // the owner's limit
};

// Times for /metrics.
struct QueueTimes {
    std::optional<int64_t> oldest_queued_ms;  // time of submission; none waits
    int64_t store_bytes = 0;                  // the file and its log
};

class JobStore {
  public:
    // `attempts`: per frame, and per job that dies before its first frame. Errors (output): the
    // file cannot be created or written, is in use, is damaged, or is from another program or a
    // later version.
    static Result<std::unique_ptr<JobStore>> open(const std::string& path, int attempts,
                                                  const Retention& keep = {});

    // Result `full` if `max_queue` jobs wait.
    Result<Added> add(const NewJob& job, size_t max_queue, const User& owner = User());
    Result<std::optional<Job>> job(const std::string& id) const;
    Result<std::optional<Job>> job_of_key(const std::string& key) const;
    // Newest first; `state`, `before`, `owner` and `search` (job_search.h) may be empty.
    Result<std::vector<Job>> jobs(const std::string& state, const std::string& before, size_t limit,
                                  const std::string& owner = "",
                                  const std::string& search = "") const;
    // The places of waiting jobs, in the order in which next() would return them.
    Result<QueuePlaces> places() const;
    // In the order of the job.
    Result<std::vector<JobFrame>> frames(const std::string& id) const;
    Result<std::optional<JobFrame>> frame(const std::string& id, int frame) const;
    Result<std::vector<Event>> events(const std::string& id, int64_t after, size_t limit) const;
    std::map<JobState, size_t> counts() const;  // of jobs; empty on failure
    QueueTimes times() const;
    // Errors (output): the file was removed or replaced after open().
    Status in_place() const;
    // Called by change or in_place() when the file is no longer in place, once until it is again.
    void on_loss(std::function<void(const std::string&)> listener);
    // Called after each commit, with the store unlocked.
    void on_event(std::function<void(const Event&)> listener);

    // The queued job with the highest priority, at least `above`. Of equals the one whose owner had
    // its turn longest ago; then the oldest.
    Result<std::optional<Job>> next(int above) const;
    // Sets the job running, counts an attempt and returns their number. 0: it is no longer queued.
    Result<int> start(const std::string& id);
    // Records the frames at the first start. Later calls change nothing.
    Status enter_frames(const std::string& id, const std::vector<JobFrame>& frames);
    Result<FrameTally> tally(const std::string& id) const;
    Result<std::vector<FrameToDo>> to_do(const std::string& id) const;
    // True after enter_frames() or, for ab, bench and study, after began().
    Result<bool> has_begun(const std::string& id) const;
    Status began(const std::string& id);

    Status frame_begins(const std::string& id, int frame);
    Status frame_ends(const std::string& id, const FrameEnd& end);
    // The frame waits again, or is quarantined after the last attempt.
    Status frame_fails(const std::string& id, int frame, const std::string& message);
    // After a stop: interrupted frames wait again, without a counted attempt.
    Status release(const std::string& id);

    // Queues a running job again. `counts`: its attempt failed.
    Status requeue(const std::string& id, const std::string& why, bool counts);
    // Reads id, state, message, exit_code and verdict of `job`.
    Status end(const Job& job);
    // Cancels a queued or running job; false for other states.
    Result<bool> cancel(const std::string& id);
    // Queues the unfinished frames of a failed or canceled job, within the owner's limits.
    Result<Retried> retry(const std::string& id, const User& owner = User());
    // Changes the priority of an unfinished job; false for other states.
    Result<bool> set_priority(const std::string& id, int priority);
    // Removes an ended job with its frames and events; false for other states, and while it has
    // tasks in another queue.
    Result<bool> forget(const std::string& id);
    // The id of a running job in another queue; empty = none.
    Result<std::string> remote(const std::string& id) const;
    // Every job that has one, ended ones too.
    Result<std::vector<std::pair<Job, std::string>>> remotes() const;
    Status set_remote(const std::string& id, const std::string& remote);
    // Adds an event of a running job without changing its state.
    Status say(const std::string& id, const std::string& type, const std::string& data);

  private:
    JobStore(const std::string& path, int attempts, const Retention& keep);
    void add_event(const std::string& id, const std::string& type, const std::string& data);
    std::string over_limit(int frames, const User& owner);
    template <class Work>
    Status change(const Work& work);
    template <class T, class Work>
    Result<T> look(const Work& work) const;

    const std::string path_;
    const int attempts_;
    const Retention keep_;
    StoreLock lock_;
    mutable std::recursive_mutex mutex_;
    mutable Database database_;
    std::pair<dev_t, ino_t> file_ = {};  // identity of the opened file
    mutable std::mutex loss_mutex_;
    mutable bool lost_ = false;
    std::function<void(const std::string&)> loss_listener_;
    std::vector<Event> said_;  // events of the open transaction
    std::mutex listener_mutex_;
    std::function<void(const Event&)> listener_;
};

}  // namespace postchain::service
