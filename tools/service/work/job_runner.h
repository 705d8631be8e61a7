// Runs the jobs of the store: hands each to a queue as an array of processes, and follows it by the
// JSON lines that these print.
//
//   store: queued --next(), as long as the queue has room--> running: name stored, submit(), id
//   stored, then frame by frame: begins, ends or fails
//
// Frames that a job's tasks did not make are handed over again, up to the attempts of the store. If
// a process dies, the frame that it had under way has failed; of several each runs alone next time,
// so that one that crashes its reader blames no other. A job that the queue refuses as often, or
// whose process ends as often before its first frame, fails with the reason.
//
// On this machine one job runs at a time, and makes way for one of larger priority, and after a
// slice of time for another user's. In another queue room is limited for all jobs and for each
// user, so that priorities and turns work as on one machine.
#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include "tools/sequence/files/json.h"
#include "tools/service/store/job_store.h"
#include "tools/service/work/counters.h"
#include "tools/service/work/job_request.h"
#include "tools/service/work/programs.h"
#include "tools/service/work/task_queue.h"

namespace postchain::service {

// How a job ends.
struct WorkEnd {
    JobState state = JobState::done;
    int exit_code = 0;
    std::string message = {};
    std::string verdict = {};

    static WorkEnd failed(const Status& status);
    void say(const std::string& text);  // adds it to the message
};

struct RunnerState {
    bool works = false;   // the queue answers
    std::string trouble;  // why jobs cannot run or their ends cannot be recorded; empty = they can
    size_t lost = 0;      // 1: the thread hangs in the queue or a disk
};

class JobRunner {
  public:
    // The arguments outlive this object.
    JobRunner(JobStore& store, const Readers& readers, const Programs& programs, Counters& counters,
              std::shared_ptr<TaskQueue> queue, const QueueSettings& settings);
    ~JobRunner();  // end()

    Status begin();
    void wake();  // there may be a new job, or one was canceled
    // Ends the tasks that end with the service within a frame, and takes no other job.
    void drain();
    // drain(), then ends the thread. Returns 1 if it hangs: what it uses must stay.
    size_t end();
    double remaining_s(const std::string& id) const;  // of a job; 0 = unknown, or it does not run
    RunnerState state() const;
    const TaskQueue& queue() const { return *queue_; }

  private:
    using Clock = std::chrono::steady_clock;

    // What a task has printed.
    struct TaskLines {
        int64_t read = 0;         // bytes
        std::set<int> in_flight;  // frames that it began and did not end
        // Of a measurement: how far it was last, and its end.
        io::Json progress = {}, last = {};
    };
    // A job in the queue. The store keeps "NAME", after submit() "NAME ID", and after submit() of
    // a study's report "NAME ID REPORT".
    struct Handed {
        Job job;
        ArrayName array, report;
    };
    struct Found {
        ArrayState array, report;
    };
    // The memory of the thread about a job in the queue; it can be lost.
    struct Followed {
        std::optional<ReadJob> read;
        int failures = 0;              // refusals by the queue, and arrays that did nothing
        std::optional<TaskRank> rank;  // as the queue has it
        Clock::time_point began = Clock::now();
        std::optional<Clock::time_point> ended;  // when the last task was seen to have ended
        std::map<int, TaskLines> tasks;
        bool seen = false;        // its lines so far were read, by this process
        std::set<int> told;       // frames of which a line was read since it was handed over
        bool progressed = false;  // a frame or measurement has ended since then
        // The tasks shall end, because the job makes way, or has failed.
        std::string makes_way;  // why
        std::optional<WorkEnd> failed;
        bool canceled = false;              // the queue knows
        Clock::time_point not_before = {};  // of the next attempt, after a failure
        int first_code = 0;                 // exit code of the first frame that failed
        bool unhealthy = false;             // --strict refused a frame
        std::string said;                   // the last event of a measurement's progress
    };
    static Handed handed_of(const Job& job);

    void loop();
    bool ends() const;
    void poll_queue();
    void hear_from_queue();
    Status guarded(const Job& job, const std::function<Status()>& work);
    Status take_waiting(size_t in_queue);
    Status take(const Job& job);
    Status begin_job(const Job& job, const ReadJob& read);
    Status check_edits(const Job& job, const ReadJob& read) const;
    Status hand_over(const Job& job, const ReadJob& read, std::string name, bool first);
    Result<TaskArray> array_of(const Job& job, const ReadJob& read, bool first) const;
    Status follow(const Handed& handed, const Found& found, const TaskRank& rank);
    Status follow_frames(const Handed& handed, const ArrayState& array);
    Status end_of_array(const Handed& handed, const ArrayState& array);
    Status follow_measurement(const Handed& handed, const ReadJob& read, const std::string& id,
                              const Found& found);
    Status submit_report(const Handed& handed, const ReadJob& read, const std::string& id);
    Result<bool> read_lines(const Handed& handed, const ReadJob& read);
    Status enter_line(const Job& job, const ReadJob& read, TaskLines& task, const io::Json& line,
                      bool again);
    Status enter_frame(const Job& job, const ReadJob& read, int frame, const io::Json& line,
                       bool again);
    void make_way(const Job& job, Followed& followed);
    Result<std::string> submit(const Job& job, const TaskArray& array);
    Status again_or_failed(const Job& job, const WorkEnd& end);
    // Null: it can no longer be read, and has failed.
    Result<const ReadJob*> read_of(const Job& job);
    bool lag_is_over(const Job& job);
    Status enter_end(const Job& job, const WorkEnd& end);
    Status end_with_rest(const Job& job, WorkEnd end);
    std::string failure_of(const std::string& folder, const ArrayState& array) const;
    // Removes folders of jobs that need none.
    void clean_up() const;
    void forget(const std::string& id);
    std::string folder_of(const std::string& id) const { return settings_.folder + "/" + id; }
    std::string folder_of(const Handed& handed) const {
        return concat(folder_of(handed.job.id), "/", handed.array.name);
    }

    JobStore& store_;
    const Readers& readers_;
    const Programs& programs_;
    Counters& counters_;
    const std::shared_ptr<TaskQueue> queue_;
    const QueueSettings settings_;
    mutable std::mutex mutex_;
    std::condition_variable changed_;
    bool awake_ = false, ends_ = false;
    bool loops_ = false;  // the thread is not at its end
    std::string trouble_;
    Clock::time_point heard_ = Clock::now();  // from the queue, and all work on its answer done
    std::map<std::string, double> remaining_s_;
    // Used by the thread alone, by the job's id.
    std::map<std::string, Followed> followed_;
    bool idle_ = false;
    size_t in_queue_ = 0;  // jobs with an array, at the last poll
    std::thread thread_;
    std::shared_ptr<std::atomic<size_t>> lost_ = std::make_shared<std::atomic<size_t>>(0);
};

// Creates the folder for chains and messages of jobs if it does not exist. Errors (usage): it is a
// link, of another user, open to others, in one of these folders, or has one of them in it;
// (output).
Status take_private_folder(const std::string& folder, const std::vector<std::string>& roots);

}  // namespace postchain::service
