// The surroundings of a running job, and how it ends.
#pragma once

#include <atomic>
#include <functional>
#include <optional>
#include <string>

#include "tools/sequence/source/frame_source.h"
#include "tools/service/store/job_store.h"
#include "tools/service/work/counters.h"
#include "tools/service/work/gl_device.h"
#include "tools/service/work/job_request.h"
#include "tools/service/work/progress.h"
#include "tools/service/work/readers.h"

namespace postchain::service {

struct WorkPlace {
    JobStore& store;
    const JobReader& reader;
    GlDevice& gl;
    Counters& counters;
    const egl::ContextOptions& device;
    std::atomic<bool>& stop;                // set: the job ends within the current frame
    const std::atomic<bool>& lost;          // set: the job has ended; the store is no longer ours
    Progress& progress;                     // steps under way
    AskTurn turn;                           // asked by the executor of `gl` too
    std::function<void()> between;          // call after each frame
    std::function<void(double)> remaining;  // call with an estimate in seconds

    // Between dispatches that no executor makes: waits while a preview has the device. False if the
    // job is to end.
    bool goes_on() const;
};

struct WorkEnd {
    enum class How {
        ended,         // with state, exit_code, message and verdict
        stopped,       // the other frames wait
        gl_failed,     // the job resumes with a new device
        store_failed,  // the job resumes when the store can be written again
    };
    How how = How::ended;
    JobState state = JobState::done;
    int exit_code = 0;
    std::string message;
    std::string verdict;

    static WorkEnd failed(const Status& status);
    void say(const std::string& text);  // adds it to the message
    static WorkEnd of(How how, const std::string& message) { return {how, {}, 0, message, {}}; }
};

// The job with the state of its end.
Job ended_job(Job job, const WorkEnd& end, const Readers& readers);

// Progress events of a job, at most one per second. Failures to store them are ignored.
class ProgressEvents {
  public:
    ProgressEvents(const WorkPlace& place, std::string job) : place_(place), job_(std::move(job)) {}
    // Waits while a preview has the device. False if the job is to end.
    bool say(const std::string& what, size_t done, size_t total);

  private:
    const WorkPlace& place_;
    const std::string job_;
    std::optional<sequence::Clock::time_point> said_;
};

}  // namespace postchain::service
