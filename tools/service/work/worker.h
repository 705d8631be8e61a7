// The backend of this machine: one thread with a GL context runs one job of the store at a time. A
// second thread watches its steps. If one takes longer than the limit, the job fails, and another
// thread with a context of its own takes the place of the one that hangs.
#pragma once

#include <atomic>
#include <condition_variable>
#include <mutex>
#include <string>
#include <thread>

#include "tools/service/store/job_store.h"
#include "tools/service/work/backend.h"
#include "tools/service/work/counters.h"
#include "tools/service/work/device_gate.h"
#include "tools/service/work/gl_device.h"
#include "tools/service/work/job_request.h"
#include "tools/service/work/job_work.h"

namespace postchain::service {

struct WorkerSettings {
    egl::ContextOptions device;
    int attempts = 3;
    double frame_timeout_s = 0;               // of each step of a frame; 0 = none
    double slice_s = 60;                      // a job makes way for another user's after this time
    std::chrono::milliseconds drain{20'000};  // for the work under way
    TryFile try_file = {};                    // before a frame that may have killed the process
};

class Worker final : public Backend {
  public:
    Worker(JobStore& store, const Readers& readers, Counters& counters, const DeviceGate& gate,
           const PassRegistry& registry, const WorkerSettings& settings);
    ~Worker() override;

    // Creates the device on the thread and starts. Errors (gl); (internal): no thread.
    Status begin() override;
    void wake() override;
    void stop_job(const std::string& id) override;
    void drain() override;
    size_t end() override;
    double remaining_s(const std::string& id) const override;
    BackendState state() const override;

  private:
    using Clock = std::chrono::steady_clock;
    // A thread with its device. It stays until its thread ends, also after it was replaced.
    struct WorkerThread {
        std::unique_ptr<GlDevice> gl;
        std::atomic<bool> stop = false;
        std::atomic<bool> lost = false;  // replaced: must not change the store
        bool preempted = false;
        Status full;  // why the running job's owner may write no more
        Progress progress;
        Clock::time_point began;                                   // the running job
        std::chrono::milliseconds wait = std::chrono::seconds(1);  // before the next retry
    };

    Status start_worker_thread();
    void loop(WorkerThread& self);
    bool next_job(WorkerThread& self) noexcept;
    void wait_longer(WorkerThread& self);
    bool make_device(WorkerThread& self);
    void work(WorkerThread& self, const Job& job);
    WorkEnd work_on(WorkerThread& self, const Job& job, int attempts);
    bool enter_end(const WorkerThread& self, const Job& job, const WorkEnd& end);
    void between(WorkerThread& self, const Job& job);
    void count_bytes(const Job& job, const JobRequest& request);
    RunDecision ask_gate(WorkerThread& self);
    void watch();
    void replace_thread(std::unique_lock<std::mutex>& lock, const Progress::UnderWay& stuck);
    void set_trouble(const std::string& text);

    JobStore& store_;
    const Readers& readers_;
    Counters& counters_;
    const DeviceGate& gate_;
    const PassRegistry& registry_;
    const WorkerSettings settings_;

    mutable std::mutex mutex_;
    std::condition_variable changed_;
    bool awake_ = false;  // there may be a new job
    bool made_ = false;   // the first device was created or failed
    Status first_;        // the result
    bool ends_ = false;   // the threads shall end
    bool draining_ = false;
    std::string running_;  // id
    double remaining_s_ = 0;
    double limit_s_ = 0;  // of the running job
    BackendState state_;
    std::shared_ptr<WorkerThread> current_;  // none: no thread could be started
    std::thread thread_, watcher_;
    std::shared_ptr<std::atomic<size_t>> lost_ = std::make_shared<std::atomic<size_t>>(0);
};

}  // namespace postchain::service
