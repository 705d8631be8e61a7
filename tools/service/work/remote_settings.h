// How jobs are handed to another queue.
#pragma once

#include <chrono>
#include <memory>
#include <string>

#include "tools/service/work/remote_queue.h"

namespace postchain::service {

struct RemoteSettings {
    std::shared_ptr<RemoteQueue> queue;  // null: jobs run on this machine
    std::string folder;                  // for chains and messages of tasks; every machine has it
    std::string program = "postchain";   // as the other machines start it
    std::string device = "auto";
    int frames_per_task = 8;
    std::string max_memory;  // of a task; empty = the queue's default
    int attempts = 3;        // until a job that the queue refuses fails
    std::chrono::milliseconds poll{2000};
    std::chrono::milliseconds drain{20'000};  // for the turn under way
};

}  // namespace postchain::service
