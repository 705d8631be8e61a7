// Another queue that runs the frames of `run` jobs on its own machines: Slurm (slurm_queue.h), or a
// farm's manager, or a cloud's batch service. remote_backend.h follows its jobs.
//
// To add one, implement the functions of RemoteQueue. The store keeps a random name before submit()
// and the id after it, so that a service that is killed between the two finds its job by the name.
#pragma once

#include <chrono>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "chain/base/status.h"

namespace postchain::service {

// What a queue's administrator and scheduler see of a job, and what may change while it is there.
struct RemoteRank {
    int priority = 0;    // -kMaxPriority..kMaxPriority, larger first
    int most_tasks = 0;  // that may run at a time; 0 = no limit
    bool operator==(const RemoteRank&) const = default;
};

// A job as an array of tasks 1, 2, ... Task i runs `command` with the words tasks[i - 1] appended,
// and may run again at any time, also while another machine still runs it: every frame is written
// once whole, and `--on-existing skip` keeps whole ones.
struct RemoteJob {
    std::string name;     // random
    std::string owner;    // the user's name; may be empty
    std::string comment;  // for people: "postchain job 12 of ann"
    std::string folder;   // of its tasks, which relative paths start at
    std::vector<std::string> command;
    std::vector<std::vector<std::string>> tasks;
    std::string log_folder;  // for the tasks' messages, TASK.log
    RemoteRank rank;
    std::string after = {};  // id of a job that must have ended, in any way, before; empty = none
    bool keeps_exit_code = false;  // task 3 writes its exit code to LOG_FOLDER/3.exit
};

// A job by its name, and by its id if that is known.
struct RemoteName {
    std::string name, id;
};

struct RemoteTasks {
    std::string id;  // empty: the queue has no job with this name
    int waiting = 0, running = 0, done = 0, failed = 0;
    int failed_task = 0;  // the last one of them
    std::string message;  // its failure: "task 3: NODE_FAIL"

    bool known() const { return waiting + running + done + failed > 0; }
    bool ended() const { return waiting + running == 0; }
};

class RemoteQueue {
  public:
    virtual ~RemoteQueue() = default;
    virtual std::string name() const = 0;  // "slurm"
    // The job's id in the queue. Errors: (usage) the queue refuses it; (output) the queue does not
    // answer.
    virtual Result<std::string> submit(const RemoteJob& job) = 0;
    // The tasks of this user's jobs, by name; of jobs that the queue no longer knows there are
    // none. One call, however many jobs there are. Errors (output): the queue does not answer.
    virtual Result<std::map<std::string, RemoteTasks>> look(
        const std::vector<RemoteName>& jobs) = 0;
    // For tasks that have not ended. Errors: as of submit().
    virtual Status change(const std::string& id, const RemoteRank& rank) = 0;
    virtual Status cancel(const std::string& id) = 0;
    // From any thread: the call under way ends within seconds, later ones fail.
    virtual void stop() {}
};

// How jobs are handed to a queue.
struct RemoteSettings {
    std::shared_ptr<RemoteQueue> queue;  // null: jobs run on this machine
    std::string folder;                  // for chains and messages of tasks; every machine has it
    std::string program = "postchain";   // as the other machines start it
    std::string device = "auto";
    int frames_per_task = 8;
    int attempts = 3;          // until a job that the queue refuses fails
    int max_jobs = 16;         // in the queue; others wait in the store
    int max_jobs_of_user = 4;  // likewise, of each named user
    int max_tasks = 0;         // running at a time, shared by users and their jobs; 0 = no limit
    std::chrono::milliseconds poll{2000};
    std::chrono::milliseconds idle_poll{10'000};  // without jobs
    std::chrono::milliseconds silence{20'000};    // of the queue, until the service is not ready
    std::chrono::milliseconds lag{30'000};  // until an ended task's files are seen on this machine
    std::chrono::milliseconds drain{20'000};  // for the poll under way
};

}  // namespace postchain::service
