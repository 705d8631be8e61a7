#include "tools/service/work/job_work.h"

#include <chrono>
#include <thread>

#include "tools/sequence/record/frame_report.h"

namespace postchain::service {

bool WorkPlace::goes_on() const {
    while (!stop && turn() == Turn::wait) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    return !stop;
}

WorkEnd WorkEnd::failed(const Status& status) {
    return {How::ended, JobState::failed, sequence::exit_code(status), status.message(), {}};
}

void WorkEnd::say(const std::string& text) {
    message += (message.empty() ? "" : "; ") + text;
}

Job ended_job(Job job, const WorkEnd& end, const Readers& readers) {
    job.state = end.state;
    job.exit_code = end.exit_code;
    job.message = readers.shown_in(end.message);
    job.verdict = end.verdict;
    return job;
}

bool ProgressEvents::say(const std::string& what, size_t done, size_t total) {
    if (place_.lost) return false;
    place_.progress.does(what + " did not end");
    if (!said_ || sequence::milliseconds_since(*said_) >= 1000) {
        said_ = sequence::Clock::now();
        const std::string shown = place_.reader.roots().shown_in(what);
        (void)place_.store.say(job_, "progress",
                               {{"what", shown}, {"done", done}, {"total", total}});
    }
    return place_.goes_on();
}

}  // namespace postchain::service
