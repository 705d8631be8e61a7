// The queue of this machine: each task is a process, one of an array at a time.
#pragma once

#include <sys/types.h>

#include <chrono>
#include <cstdint>
#include <map>
#include <optional>
#include <string>

#include "tools/service/work/task_queue.h"

namespace postchain::service {

struct LocalSettings {
    uint64_t memory = 0;  // bytes of its own that a task may write; 0 = no limit
    int nice = 10;        // previews and requests go first
    std::chrono::milliseconds grace{30'000};  // of a canceled task for its frame, then it is killed
};

// Used by one thread.
class LocalQueue final : public TaskQueue {
  public:
    explicit LocalQueue(const LocalSettings& settings) : settings_(settings) {}
    ~LocalQueue() override;  // kills every task

    std::string name() const override { return "processes"; }
    bool outlives() const override { return false; }
    Result<std::string> submit(const TaskArray& array) override;
    Result<std::map<std::string, ArrayState>> look(const std::vector<ArrayName>& arrays) override;
    Status change(const std::string&, const TaskRank&) override { return Status(); }
    Status cancel(const std::string& id) override;

  private:
    using Clock = std::chrono::steady_clock;
    struct Running {
        TaskArray array;
        ArrayState state;
        pid_t process = -1;  // of task state.done + state.failed + 1
        int64_t printed = 0;
        Clock::time_point printed_at;
        std::optional<Clock::time_point> canceled;
    };
    Status start_next(Running& running) const;
    void follow(Running& running) const;
    static void enter_end(Running& running, int code, const std::string& why);

    const LocalSettings settings_;
    std::map<std::string, Running> arrays_;  // by name, which is the id too
};

}  // namespace postchain::service
