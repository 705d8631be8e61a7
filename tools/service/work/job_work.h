// What work on a job needs, and how it ends.
#pragma once

#include <atomic>
#include <functional>
#include <optional>
#include <string>

#include "tools/sequence/run/clock.h"
#include "tools/service/store/job_store.h"
#include "tools/service/work/counters.h"
#include "tools/service/work/gl_device.h"
#include "tools/service/work/job_request.h"

namespace postchain::service {

struct WorkPlace {
    JobStore& store;
    const JobReader& reader;
    GlDevice& gl;
    Counters& counters;
    const egl::ContextOptions& device;
    std::atomic<bool>& stop;                // ends the work after the frame under way
    std::function<void()> between;          // after each frame, on this thread
    std::function<void(double)> remaining;  // seconds, an estimate
};

struct WorkEnd {
    enum class How {
        ended,         // state, exit_code, message and verdict say how
        stopped,       // the rest waits
        gl_failed,     // the device is to be made anew, and the job goes on
        store_failed,  // nothing could be entered; the job goes on when that is so again
    };
    How how = How::ended;
    JobState state = JobState::done;
    int exit_code = 0;
    std::string message;
    std::string verdict;

    static WorkEnd failed(const Status& status);
    static WorkEnd of(How how, const std::string& message) { return {how, {}, 0, message, {}}; }
};

// What a job is doing, as an event: once a second at most. What cannot be entered is not missed.
class ProgressEvents {
  public:
    ProgressEvents(JobStore& store, const Roots& roots, std::string job)
        : store_(store), roots_(roots), job_(std::move(job)) {}
    void say(const std::string& what, size_t done, size_t total);

  private:
    JobStore& store_;
    const Roots& roots_;
    const std::string job_;
    std::optional<sequence::Clock::time_point> said_;
};

}  // namespace postchain::service
