// The store of jobs: one SQLite file in WAL mode that outlives the process.
//
//   add --> queued --start--> running --end--> done, failed, canceled
//              ^                 |
//              +--- requeue, or the process ended ---+
//
// Every change of a state is one transaction, with its event, and is on the disk (synchronous=FULL)
// before the call returns: what a call has answered is never lost, and of a call that failed
// nothing is there. One process at a time has the file. Safe in several threads.
//
// A frame is entered as begun before its first file is opened. What is begun when the process dies
// is found by the next open(): docs/service.md, "After a crash".
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "chain/status.h"
#include "tools/service/store/job.h"
#include "tools/service/store/sqlite.h"

namespace postchain::service {

// A frame that is to be done.
struct FrameToDo {
    int frame = 0;
    int attempts = 0;
    bool begun = false;  // once: its output may be there, made by this job
    bool alone = false;  // it was in flight when a process died: others are not to suffer by it
};

// How a frame ended.
struct FrameEnd {
    int frame = 0;
    FrameState state = FrameState::written;
    std::string message;  // of a frame that is written: what is worth knowing
    bool held = false;    // another frame's picture stands in
    double filter_ms = 0;
    std::string sidecar;
};

// The frames of a job by how they ended.
struct FrameTally {
    int waiting = 0, held = 0, missing = 0;
    std::vector<int> set_aside;
};

struct Added {
    enum class What { made, same, other_body, full };
    What what = What::made;
    Job job;  // but for `full`
};

class JobStore {
  public:
    // `attempts`: of a frame, and of a job that dies before its first one, before they are given
    // up. Errors (output): the file cannot be made or written, another process has it, it is
    // damaged, of another program or of a later version.
    static Result<std::unique_ptr<JobStore>> open(const std::string& path, int attempts);

    // `key` may be empty. Refused where `max_queue` jobs wait.
    Result<Added> add(JobKind kind, const std::string& body, int priority, const std::string& key,
                      size_t max_queue);
    Result<std::optional<Job>> job(const std::string& id) const;
    Result<std::optional<Job>> job_of_key(const std::string& key) const;
    // Newest first; `state` and `before` may be empty.
    Result<std::vector<Job>> jobs(const std::string& state, const std::string& before,
                                  size_t limit) const;
    // In the order of the job, without their sidecars.
    Result<std::vector<JobFrame>> frames(const std::string& id) const;
    // With its sidecar.
    Result<std::optional<JobFrame>> frame(const std::string& id, int frame) const;
    Result<std::vector<Event>> events(const std::string& id, int64_t after, size_t limit) const;
    std::map<JobState, size_t> counts() const;  // jobs; empty where they cannot be counted
    // Called after each commit, with the store unlocked.
    void on_event(std::function<void(const Event&)> listener);

    // The queued job with the largest priority, of those the oldest; of `above` and up.
    Result<std::optional<Job>> next(int above) const;
    // Running; counts an attempt of the job and returns how many there were. 0: it waits no more.
    Result<int> start(const std::string& id);
    // What was decided when it first started. Nothing is entered twice.
    Status enter_frames(const std::string& id, const std::vector<JobFrame>& frames);
    Result<FrameTally> tally(const std::string& id) const;
    Result<std::vector<FrameToDo>> to_do(const std::string& id) const;
    // False until enter_frames(), and of ab and bench until began().
    Result<bool> has_begun(const std::string& id) const;
    Status began(const std::string& id);

    Status frame_begins(const std::string& id, int frame);
    Status frame_ends(const std::string& id, const FrameEnd& end);
    // Waits again, or is set aside after the last attempt.
    Status frame_fails(const std::string& id, int frame, const std::string& message);
    // Frames that were begun and given up by a stop: their attempts do not count.
    Status release(const std::string& id);

    // Of a job that runs. `counts`: the attempt of the job failed.
    Status requeue(const std::string& id, const std::string& why, bool counts);
    // `job`: id, state, message, exit_code, verdict.
    Status end(const Job& job);
    // What waits or runs; false where the state does not allow it.
    Result<bool> cancel(const std::string& id);
    // What failed or was canceled: everything that is not done waits again.
    Result<bool> retry(const std::string& id);
    // Of a job that runs; not a change of its state.
    Status say(const std::string& id, const std::string& type, const std::string& data);

  private:
    JobStore(const std::string& path, int attempts);
    void add_event(const std::string& id, const std::string& type, const std::string& data);
    template <class Work>
    Status change(const Work& work);
    template <class T, class Work>
    Result<T> look(const Work& work) const;

    const std::string path_;
    const int attempts_;
    mutable std::recursive_mutex mutex_;
    mutable Database database_;
    std::vector<Event> said_;  // of the transaction that is open
    std::mutex listener_mutex_;
    std::function<void(const Event&)> listener_;
};

}  // namespace postchain::service
