// The thread of the service that owns GL: takes jobs from the store, one after the other, and
// errands between their frames.
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

// With the device, or with null where there is none; throws nothing.
using Errand = std::function<void(GlDevice* gl)>;

class Worker {
  public:
    Worker(JobStore& store, const JobReader& reader, Counters& counters,
           const PassRegistry& registry, const egl::ContextOptions& device, int attempts);
    ~Worker();  // drain(), then ends the thread; errands that wait get null

    // Makes the device on the thread, and begins. Errors (gl); (internal): no thread.
    Status begin();
    void wake();                           // there may be work
    void stop_job(const std::string& id);  // it was canceled
    void drain();  // waits until no job is under way; none is begun any more
    void run(Errand errand);

    // Of the job under way; empty and 0 without one.
    std::pair<std::string, double> under_way() const;
    struct State {
        bool gl = false;
        std::string renderer, trouble;  // trouble: of GL or the store, empty without
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
    bool awake_ = false;  // there may be work
    bool made_ = false;   // the first device, or it failed
    Status first_;        // how that went
    bool ends_ = false;   // the thread is to end
    bool draining_ = false;
    std::string running_;  // id
    double remaining_s_ = 0;
    State state_;

    std::unique_ptr<GlDevice> gl_;  // of the thread
    std::atomic<bool> stop_ = false;
    bool preempted_ = false;          // of the thread
    std::chrono::milliseconds wait_;  // of the thread: before what failed is tried again
    std::thread thread_;
};

}  // namespace postchain::service
