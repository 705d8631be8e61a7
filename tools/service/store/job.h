// Jobs, frames and events as the store keeps them.
#pragma once

#include <array>
#include <chrono>
#include <cstdint>
#include <string>

namespace postchain::service {

enum class JobKind { run, ab, bench, study };
enum class JobState { queued, running, done, failed, canceled };
enum class FrameState {
    waiting,
    written,      // by this job
    skipped,      // already complete, made by the same chain from the same input
    missing,      // not among the input's frames
    quarantined,  // failed in all ServiceSettings::attempts
};
inline constexpr std::array kJobKinds = {JobKind::run, JobKind::ab, JobKind::bench, JobKind::study};
inline constexpr std::array kJobStates = {JobState::queued, JobState::running, JobState::done,
                                          JobState::failed, JobState::canceled};
inline constexpr std::array kFrameStates = {FrameState::waiting, FrameState::written,
                                            FrameState::skipped, FrameState::missing,
                                            FrameState::quarantined};
inline const char* name_of(JobKind kind) {
    constexpr std::array kNames = {"run", "ab", "bench", "study"};
    static_assert(kNames.size() == kJobKinds.size());
    return kNames[size_t(kind)];
}
inline const char* name_of(JobState state) {
    constexpr std::array kNames = {"queued", "running", "done", "failed", "canceled"};
    static_assert(kNames.size() == kJobStates.size());
    return kNames[size_t(state)];
}
inline const char* name_of(FrameState state) {
    constexpr std::array kNames = {"waiting", "written", "skipped", "missing", "quarantined"};
    static_assert(kNames.size() == kFrameStates.size());
    return kNames[size_t(state)];
}

inline constexpr int kMaxPriority = 100;

struct Job {
    std::string id;
    JobKind kind = JobKind::run;
    JobState state = JobState::queued;
    int priority = 0;        // -kMaxPriority..kMaxPriority, larger first; then by arrival
    std::string owner;       // a user's name; empty without a file of users
    std::string body;        // the request as received; empty in lists
    std::string about;       // JSON: input, output, chains and study of the request, as in lists
    std::string message;     // reason of a failure, or notes
    int64_t created_ms = 0;  // milliseconds since 1970-01-01 UTC; 0 = not yet
    int64_t started_ms = 0;
    int64_t ended_ms = 0;
    int frames = 0;          // 0 = not known yet
    int done = 0;            // written, skipped
    int failed = 0;          // missing, quarantined
    int64_t bytes = 0;       // of the outputs that it wrote
    int place = 0;           // in the queue, from 1; 0 = it does not wait
    double remaining_s = 0;  // estimate while the job runs; 0 = unknown
    int exit_code = 0;       // as of the command
    std::string verdict;     // ab, bench and study: one line
    bool begun = false;      // its checks were made, its frames are known; not shown
    std::string remote;      // names and ids of its arrays in a queue; empty = none; not shown
};

struct JobFrame {
    int frame = 0;
    FrameState state = FrameState::waiting;
    int attempts = 0;
    std::string output;   // as in the job
    std::string message;  // the last failure
    double filter_ms = 0;
    std::string sidecar;  // JSON, read from the file beside the output; empty = none
};

struct Event {
    int64_t id = 0;  // increases over all jobs and restarts
    std::string job;
    int64_t time_ms = 0;
    std::string type;  // "queued", "started", "frame", "quarantined", "requeued", "done", ...
    std::string data;  // a JSON object on one line
};

// Ended jobs that a store keeps; the oldest ones are removed first.
struct Retention {
    int jobs = 1000;
    int days = 0;  // since their end; 0 = no limit
};
inline constexpr int kMaxEndedFrames = 200'000;  // in all
// Limit on events, without those of unfinished jobs.
inline constexpr int kMaxEvents = 100'000;

inline int64_t now_ms() {  // since 1970-01-01 UTC
    using namespace std::chrono;
    return duration_cast<milliseconds>(system_clock::now().time_since_epoch()).count();
}

}  // namespace postchain::service
