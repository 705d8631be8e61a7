// The surroundings of a running job, its progress, and how it ends.
#pragma once

#include <atomic>
#include <chrono>
#include <functional>
#include <map>
#include <mutex>
#include <optional>
#include <string>

#include "tools/sequence/source/frame_source.h"
#include "tools/service/store/job_store.h"
#include "tools/service/work/counters.h"
#include "tools/service/work/gl_device.h"
#include "tools/service/work/job_files.h"
#include "tools/service/work/job_request.h"

namespace postchain::service {

// Which steps of the running job are under way, and since when: a step that takes too long hangs.
class Progress {
  public:
    using Clock = std::chrono::steady_clock;
    void step(sequence::FrameStep step, int frame, bool begins,
              Clock::time_point now = Clock::now());
    // Work that is not a step of one frame: "the job was not read". Empty = none.
    void does(const std::string& what);
    // The job waits for the device, or no longer: its filtering does not take this time. Returns
    // the seconds since the last call if it has waited since.
    double waits(bool waits, Clock::time_point now = Clock::now());

    struct UnderWay {
        std::optional<sequence::FrameStep> step;
        std::optional<int> frame;
        std::string what;  // "frame 3 was not read"
        double seconds = 0;
    };
    std::optional<UnderWay> longest(Clock::time_point now = Clock::now()) const;

  private:
    struct Step {
        int frame = 0;
        Clock::time_point since;
    };
    mutable std::mutex mutex_;
    std::map<sequence::FrameStep, Step> steps_;
    std::string does_;
    Clock::time_point does_since_;
    std::optional<Clock::time_point> waits_since_;
};

// Reads a file in another process. Errors (input): it cannot be read. Empty = no such process.
using TryFile = std::function<Status(const ShownFrame&, const Roots&)>;

struct WorkContext {
    JobStore& store;
    const JobReader& reader;
    GlDevice& gl;
    Counters& counters;
    const egl::ContextOptions& device;
    std::atomic<bool>& stop;        // set: the job ends within the current frame
    const std::atomic<bool>& lost;  // set: the job has ended; the store is no longer ours
    Progress& progress;             // steps under way
    const TryFile& try_file;
    ContinueCallback ask_gate;              // asked by the executor of `gl` too
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
    ProgressEvents(const WorkContext& context, std::string job)
        : context_(context), job_(std::move(job)) {}
    // Waits while a preview has the device. False if the job is to end.
    bool say(const std::string& what, size_t done, size_t total);

  private:
    const WorkContext& context_;
    const std::string job_;
    std::optional<sequence::Clock::time_point> said_;
};

}  // namespace postchain::service
