// What the store keeps of a job.
#pragma once

#include <cstdint>
#include <string>

namespace postchain::service {

enum class JobKind { run, ab, bench, study };
enum class JobState { queued, running, done, failed, canceled };
enum class FrameState {
    waiting,
    written,    // by this job
    skipped,    // there already, made by the same chain from the same input
    missing,    // the input has no such frame
    set_aside,  // failed as often as ServiceSettings::attempts allows
};
const char* name_of(JobKind kind);
const char* name_of(JobState state);
const char* name_of(FrameState state);

struct Job {
    std::string id;
    JobKind kind = JobKind::run;
    JobState state = JobState::queued;
    int priority = 0;        // -100..100, larger first; then in the order of arrival
    std::string body;        // the request, as it came
    std::string message;     // why it failed, or what is worth knowing
    int64_t created_ms = 0;  // since 1970-01-01 UTC; 0 = not yet
    int64_t started_ms = 0;
    int64_t ended_ms = 0;
    int frames = 0;          // of the job, once known
    int done = 0;            // written, skipped
    int failed = 0;          // missing, set aside
    double remaining_s = 0;  // estimate while it runs; 0 = unknown
    int exit_code = 0;       // what the command would have ended with
    std::string verdict;     // of ab and bench, one line
};

struct JobFrame {
    int frame = 0;
    FrameState state = FrameState::waiting;
    int attempts = 0;
    std::string output;   // as in the job
    std::string message;  // of the last failure
    double filter_ms = 0;
    std::string sidecar;  // JSON: what ran, what was left out and why, times of each pass
};

struct Event {
    int64_t id = 0;  // grows over all jobs and restarts
    std::string job;
    int64_t time_ms = 0;
    std::string type;  // "queued", "started", "frame", "set_aside", "requeued", "done", ...
    std::string data;  // a JSON object on one line
};

}  // namespace postchain::service
