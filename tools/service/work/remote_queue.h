// Another queue that runs the frames of `run` jobs on its own machines: Slurm (slurm_queue.h), or a
// farm's manager, or a cloud's batch service. remote_backend.h follows its jobs.
//
// To add one, implement the four functions of RemoteQueue. The store keeps the id of submit()
// before the job counts as submitted, so that a service that is killed follows the same job when it
// starts again; find() closes the gap between the two.
#pragma once

#include <chrono>
#include <memory>
#include <string>
#include <vector>

#include "chain/base/status.h"

namespace postchain::service {

// A job as array of tasks 1..tasks. Task i runs the command with "--chunk i/tasks" appended, and
// may run again at any time, also while another machine still runs it: every frame is written once
// whole, and `--on-existing skip` keeps whole ones.
struct RemoteJob {
    std::string name;                  // unique: of this store and job
    std::vector<std::string> command;  // program and words
    int tasks = 1;
    std::string log_folder;  // for the tasks' messages
    std::string max_memory;  // of a task, "8G"; empty = the queue's default
};

struct RemoteTasks {
    int waiting = 0, running = 0, done = 0, failed = 0;
    bool known = true;    // the queue knows the job, or knew it
    std::string message;  // of a failure: "task 3: NODE_FAIL"

    bool ended() const { return waiting + running == 0; }
};

class RemoteQueue {
  public:
    virtual ~RemoteQueue() = default;
    virtual std::string name() const = 0;  // "slurm"
    // The job's id in the queue. Errors: (usage) the queue refuses it; (output) the queue does not
    // answer.
    virtual Result<std::string> submit(const RemoteJob& job) = 0;
    // The id of an unfinished job with this name; empty = none.
    virtual Result<std::string> find(const std::string& name) = 0;
    virtual Result<RemoteTasks> look(const std::string& id) = 0;
    virtual Status cancel(const std::string& id) = 0;
};

// How jobs are handed to a queue.
struct RemoteSettings {
    std::shared_ptr<RemoteQueue> queue;  // null: jobs run on this machine
    std::string folder;                  // for chains and messages of tasks; every machine has it
    std::string program = "postchain";   // as the other machines start it
    std::string device = "auto";
    int frames_per_task = 8;
    std::string max_memory;  // of a task; empty = the queue's default
    int attempts = 3;        // until a job that the queue refuses fails
    std::chrono::milliseconds poll{2000};
    std::chrono::milliseconds drain{20'000};  // for the poll under way
};

}  // namespace postchain::service
