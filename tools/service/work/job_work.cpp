#include "tools/service/work/job_work.h"

#include <thread>

#include "tools/sequence/record/frame_report.h"

namespace postchain::service {
namespace {

// Such a text may be from a user's file, and every list of jobs has it.
std::string shortened(std::string text) {
    constexpr size_t kMost = 16'384;  // bytes
    if (text.size() <= kMost) return text;
    size_t end = kMost - 3;
    while (end > 0 && (text[end] & 0xc0) == 0x80) --end;  // within a character of UTF-8
    return text.substr(0, end) + "...";
}

}  // namespace

void Progress::step(sequence::FrameStep step, int frame, bool begins, Clock::time_point now) {
    const std::lock_guard lock(mutex_);
    if (step == sequence::FrameStep::filter) waits_since_.reset();
    if (begins)
        steps_[step] = {frame, now};
    else
        steps_.erase(step);
}

void Progress::does(const std::string& what) {
    const std::lock_guard lock(mutex_);
    does_ = what;
    does_since_ = Clock::now();
    waits_since_.reset();
}

double Progress::waits(bool waits, Clock::time_point now) {
    const std::lock_guard lock(mutex_);
    const auto waited = waits_since_ ? now - *waits_since_ : Clock::duration();
    if (const auto filter = steps_.find(sequence::FrameStep::filter); filter != steps_.end())
        filter->second.since += waited;
    does_since_ += waited;
    waits_since_.reset();
    if (waits) waits_since_ = now;
    return std::chrono::duration<double>(waited).count();
}

std::optional<Progress::UnderWay> Progress::longest(Clock::time_point now) const {
    const std::lock_guard lock(mutex_);
    std::optional<UnderWay> longest;
    const auto consider = [&](Clock::time_point since, UnderWay under_way) {
        under_way.seconds = std::chrono::duration<double>(now - since).count();
        if (!longest || under_way.seconds > longest->seconds) longest = std::move(under_way);
    };
    for (const auto& [step, one] : steps_)
        consider(one.since,
                 {step, one.frame, concat("frame ", one.frame, " was not ", name_of(step)), 0});
    if (!does_.empty()) consider(does_since_, {std::nullopt, std::nullopt, does_, 0});
    return longest;
}

bool WorkContext::goes_on() const {
    while (!stop && ask_gate() == RunDecision::wait)
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
    return !stop;
}

WorkEnd WorkEnd::failed(const Status& status) {
    return {How::ended, JobState::failed, postchain::exit_code(status), status.message(), {}};
}

void WorkEnd::say(const std::string& text) {
    message += (message.empty() ? "" : "; ") + text;
}

Job ended_job(Job job, const WorkEnd& end, const Readers& readers) {
    job.state = end.state;
    job.exit_code = end.exit_code;
    job.message = shortened(readers.shown_in(end.message));
    job.verdict = shortened(end.verdict);
    return job;
}

bool ProgressEvents::say(const std::string& what, size_t done, size_t total) {
    if (context_.lost) return false;
    context_.progress.does(what + " did not end");
    if (!said_ || sequence::milliseconds_since(*said_) >= 1000) {
        said_ = sequence::Clock::now();
        const std::string shown = context_.reader.roots().shown_in(what);
        (void)context_.store.say(job_, "progress",
                                 {{"what", shown}, {"done", done}, {"total", total}});
    }
    return context_.goes_on();
}

}  // namespace postchain::service
