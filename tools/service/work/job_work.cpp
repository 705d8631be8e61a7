#include "tools/service/work/job_work.h"

#include <chrono>
#include <thread>

#include "tools/sequence/run/exit_code.h"

namespace postchain::service {

bool WorkPlace::goes_on() const {
    while (!stop && turn() == Turn::wait) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    return !stop;
}

WorkEnd WorkEnd::failed(const Status& status) {
    return {How::ended, JobState::failed, sequence::exit_code(status), status.message(), {}};
}

void ProgressEvents::say(const std::string& what, size_t done, size_t total) {
    if (said_ && sequence::milliseconds_since(*said_) < 1000) return;
    said_ = sequence::Clock::now();
    (void)store_.say(job_, "progress",
                     {{"what", roots_.shown_in(what)}, {"done", done}, {"total", total}});
}

}  // namespace postchain::service
