// A queue that runs jobs as arrays of processes: those of this machine (local_queue.h), Slurm
// (slurm_queue.h), a farm's manager, or a cloud's batch service. job_runner.h follows them.
//
// To add one, implement the functions of TaskQueue. The store keeps a random name before submit()
// and the id after it, so that a service that is killed between the two finds its array by the
// name.
#pragma once

#include <chrono>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "chain/base/status.h"

namespace postchain::service {

// What a queue's administrator and scheduler see of an array, and what may change while it is
// there.
struct TaskRank {
    int priority = 0;    // -kMaxPriority..kMaxPriority, larger first
    int most_tasks = 0;  // that may run at a time; 0 = no limit
    bool operator==(const TaskRank&) const = default;
};

// Tasks 1, 2, ... of a job. Task i runs `command` with the words tasks[i - 1] appended. Its
// standard output goes to LOG_FOLDER/i.events, what it prints as errors to LOG_FOLDER/i.log, and
// its exit code to LOG_FOLDER/i.exit. It may run again at any time, also while another machine
// still runs it: every frame is written once whole, and `--on-existing skip` keeps whole ones.
struct TaskArray {
    std::string name;     // random
    std::string owner;    // the user's name; may be empty
    std::string comment;  // for people: "postchain job 12 of ann"
    std::string folder;   // of its tasks, which relative paths start at
    std::vector<std::string> command;
    std::vector<std::vector<std::string>> tasks;
    std::string log_folder;
    TaskRank rank;
    std::string after =
        {};                // id of an array that must have ended, in any way, before; empty = none
    double silence_s = 0;  // a task that prints nothing for so long is killed; 0 = it may
};

// An array by its name, and by its id if that is known.
struct ArrayName {
    std::string name, id;
};

struct ArrayState {
    std::string id;  // empty: the queue has no array with this name
    int waiting = 0, running = 0, done = 0, failed = 0;  // tasks
    int failed_task = 0;                                 // the last one of them
    std::string message;                                 // its failure: "task 3: NODE_FAIL"

    bool known() const { return waiting + running + done + failed > 0; }
    bool ended() const { return waiting + running == 0; }
};

class TaskQueue {
  public:
    virtual ~TaskQueue() = default;
    virtual std::string name() const = 0;  // "slurm"
    // Whether arrays outlive the service. Those of this machine end with it.
    virtual bool outlives() const { return true; }
    // The array's id in the queue. Errors: (usage) the queue refuses it; (output) the queue does
    // not answer.
    virtual Result<std::string> submit(const TaskArray& array) = 0;
    // Arrays by name; of those that the queue no longer knows there are no tasks. One call, however
    // many there are. Errors (output): the queue does not answer.
    virtual Result<std::map<std::string, ArrayState>> look(
        const std::vector<ArrayName>& arrays) = 0;
    // For tasks that have not ended. Errors: as of submit(). A task that is canceled may end its
    // frame.
    virtual Status change(const std::string& id, const TaskRank& rank) = 0;
    virtual Status cancel(const std::string& id) = 0;
    // From any thread: the call under way ends within seconds, later ones fail.
    virtual void stop() {}
};

// How jobs are handed to a queue.
struct QueueSettings {
    std::string folder;                 // for chains and messages of tasks; every machine has it
    std::string program = "postchain";  // as the queue's machines start it
    std::string device = "auto";
    uint64_t max_memory = 0;     // --max-memory of a task at most, bytes; 0 = as the job asks
    int threads = 0;             // of a task; 0 = the queue chooses
    int frames_per_task = 8;     // 0 = all
    int attempts = 3;            // until a job that the queue refuses fails
    int max_jobs = 16;           // in the queue; others wait in the store
    int max_jobs_of_user = 4;    // likewise, of each named user
    int max_tasks = 0;           // running at a time, shared by users and their jobs; 0 = no limit
    double frame_timeout_s = 0;  // TaskArray::silence_s of a job that sets none
    double slice_s = 0;  // a job makes way for another user's after this time; 0 = it does not
    std::chrono::milliseconds poll{2000};
    std::chrono::milliseconds idle_poll{10'000};  // without jobs
    std::chrono::milliseconds silence{20'000};    // of the queue, until the service is not ready
    std::chrono::milliseconds lag{30'000};  // until an ended task's files are seen on this machine
    std::chrono::milliseconds drain{20'000};  // for the poll under way, and tasks that end with us
};

}  // namespace postchain::service
