// The thread that owns the GL context: runs one job of the store at a time, and errands between its
// frames.
#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <deque>
#include <functional>
#include <mutex>
#include <string>
#include <thread>

#include "tools/service/store/job_store.h"
#include "tools/service/work/counters.h"
#include "tools/service/work/gl_device.h"
#include "tools/service/work/job_request.h"
#include "tools/service/work/job_work.h"

namespace postchain::service {

// Called with the device, or with null if there is none. Must not throw.
using Errand = std::function<void(GlDevice* gl)>;

class Worker {
  public:
    Worker(JobStore& store, const JobReader& reader, Counters& counters,
           const PassRegistry& registry, const egl::ContextOptions& device, int attempts);
    ~Worker();  // drain(), then ends the thread; waiting errands get null

    // Creates the device on the thread and starts. Errors (gl); (internal): no thread.
    Status begin();
    void wake();                           // there may be a new job
    void stop_job(const std::string& id);  // after it was canceled
    void drain();  // waits for the end of the running job and starts no other
    void run(Errand errand);

    // Id and remaining seconds of the running job; empty and 0 if none runs.
    std::pair<std::string, double> under_way() const;
    struct State {
        bool gl = false;
        std::string renderer, trouble;  // trouble: failure of GL or the store, empty = none
    };
    State state() const;

  private:
    using Clock = std::chrono::steady_clock;
    void loop();
    bool turn() noexcept;
    void wait_longer();
    void run_errands();
    bool make_device();
    void work(const Job& job);
    WorkEnd work_on(const Job& job, int attempts);
    bool enter_end(const Job& job, const WorkEnd& end);
    void between(const Job& job);
    void pause(std::chrono::milliseconds time);
    void set_trouble(const std::string& text);

    JobStore& store_;
    const JobReader& reader_;
    Counters& counters_;
    const PassRegistry& registry_;
    const egl::ContextOptions device_options_;
    const int attempts_;

    mutable std::mutex mutex_;
    std::condition_variable changed_;
    std::deque<Errand> errands_;
    bool awake_ = false;  // there may be a new job
    bool made_ = false;   // the first device was created or failed
    Status first_;        // the result
    bool ends_ = false;   // the thread shall end
    bool draining_ = false;
    std::string running_;  // id
    double remaining_s_ = 0;
    State state_;

    std::unique_ptr<GlDevice> gl_;  // used by the thread only
    std::atomic<bool> stop_ = false;
    bool preempted_ = false;          // used by the thread only
    std::chrono::milliseconds wait_;  // used by the thread only: delay before the next retry
    std::thread thread_;
};

}  // namespace postchain::service
