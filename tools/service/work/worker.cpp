#include "tools/service/work/worker.h"

#include <sys/resource.h>

#include <filesystem>

#include "tools/service/work/experiment_work.h"
#include "tools/service/work/frames_work.h"
#include "tools/service/work/helper_threads.h"
#include "tools/service/work/study_work.h"

namespace postchain::service {
namespace {

namespace fs = std::filesystem;
using namespace std::chrono_literals;

constexpr std::chrono::milliseconds kFirstWait = 1s;
constexpr std::chrono::milliseconds kLongestWait = 30s;
constexpr size_t kMaxLost = 8;  // each holds a frame's memory and a GL context
constexpr int kNice = 10;       // of the threads of jobs: previews and requests go first

Status failure_of(const Progress::UnderWay& stuck, double limit_s) {
    using sequence::FrameStep;
    const StatusCode code = stuck.step == FrameStep::filter  ? StatusCode::gl
                            : stuck.step == FrameStep::write ? StatusCode::output
                                                             : StatusCode::input;
    const char* cause = stuck.step == FrameStep::filter
                            ? "the GL device hangs, or the limit is too low for this chain"
                            : "the disk hangs, or the limit is too low for it";
    return Status(code, concat(stuck.what, " within ", limit_s, " s: ", cause,
                               "; then retry the job, or submit it with a larger frame_timeout"));
}

// Size of the files in the folder that an ab, bench or study writes.
int64_t bytes_of_report(const JobRequest& request) {
    const std::string& folder = request.kind == JobKind::ab      ? request.ab.folder
                                : request.kind == JobKind::bench ? request.bench.folder
                                                                 : request.study_settings.folder;
    int64_t sum = 0;
    std::error_code error;
    for (fs::recursive_directory_iterator at(folder, error), end; !error && at != end;
         at.increment(error)) {
        std::error_code of_file;
        if (!at->is_regular_file(of_file) || at->is_symlink(of_file)) continue;
        if (const auto bytes = at->file_size(of_file); !of_file) sum += int64_t(bytes);
    }
    return sum;
}

}  // namespace

Worker::Worker(JobStore& store, const Readers& readers, Counters& counters, const DeviceGate& gate,
               const PassRegistry& registry, const WorkerSettings& settings)
    : store_(store),
      readers_(readers),
      counters_(counters),
      gate_(gate),
      registry_(registry),
      settings_(settings) {}

Worker::~Worker() {
    end();
}

Status Worker::begin() {
    {
        std::unique_lock lock(mutex_);
        RETURN_IF_ERROR(take_on());
        changed_.wait(lock, [&] { return made_; });
        if (!first_.ok()) return first_;
    }
    auto watcher = start_thread([this] { watch(); });
    if (watcher.ok()) watcher_ = std::move(*watcher);
    return watcher.status();
}

// Requires the lock.
Status Worker::take_on() {
    hand_.reset();
    auto hand = std::make_shared<Hand>();
    auto thread = start_thread([this, hand, lost = lost_] {
        loop(*hand);
        if (hand->lost) --*lost;
    });
    if (!thread.ok()) return thread.status();
    thread_ = std::move(*thread);
    hand_ = std::move(hand);
    return Status();
}

void Worker::wake() {
    const std::lock_guard lock(mutex_);
    awake_ = true;
    changed_.notify_all();
}

void Worker::stop_job(const std::string& id) {
    const std::lock_guard lock(mutex_);
    if (running_ == id && hand_) hand_->stop = true;
}

void Worker::drain() {
    std::unique_lock lock(mutex_);
    draining_ = true;
    if (hand_) hand_->stop = true;
    changed_.notify_all();
    if (changed_.wait_for(lock, settings_.drain, [&] { return running_.empty(); })) return;
    // The step hangs. The job waits for the next process, without a counted attempt.
    if (!hand_) return;
    const std::string id = running_;
    hand_->lost = true;
    hand_.reset();
    thread_.detach();
    ++*lost_;
    lock.unlock();
    (void)store_.release(id);
    (void)store_.requeue(id, "stopped", false);
    lock.lock();
    running_.clear();
    changed_.notify_all();
}

size_t Worker::end() {
    drain();
    {
        const std::lock_guard lock(mutex_);
        ends_ = true;
        changed_.notify_all();
    }
    if (watcher_.joinable()) watcher_.join();
    if (thread_.joinable()) thread_.join();
    return *lost_;
}

double Worker::remaining_s(const std::string& id) const {
    const std::lock_guard lock(mutex_);
    return id == running_ ? remaining_s_ : 0;
}

BackendState Worker::state() const {
    const std::lock_guard lock(mutex_);
    BackendState state = state_;
    state.lost = *lost_;
    state.step_limit_s = limit_s_;
    if (hand_ && !running_.empty())
        if (const auto longest = hand_->progress.longest()) state.oldest_step_s = longest->seconds;
    return state;
}

void Worker::set_trouble(const std::string& text) {
    const std::lock_guard lock(mutex_);
    state_.trouble = text;
}

// ------------------------------------------------------------------------------ the watcher

void Worker::watch() {
    std::unique_lock lock(mutex_);
    while (!ends_) {
        changed_.wait_for(lock, 200ms);
        if (ends_ || draining_) continue;
        if (!hand_) {
            if (*lost_ < kMaxLost) (void)take_on();
            continue;
        }
        if (running_.empty() || limit_s_ <= 0) continue;
        const auto longest = hand_->progress.longest();
        if (longest && longest->seconds > limit_s_) let_go(lock, *longest);
    }
}

// Ends the job of a hand whose step hangs, and takes on another hand.
void Worker::let_go(std::unique_lock<std::mutex>& lock, const Progress::UnderWay& stuck) {
    const std::string id = running_;
    const Status failure = failure_of(stuck, limit_s_);
    hand_->stop = true;
    hand_->lost = true;
    hand_.reset();
    thread_.detach();
    ++*lost_;
    ++state_.replaced;
    lock.unlock();
    if (stuck.frame) (void)store_.frame_fails(id, *stuck.frame, failure.message());
    (void)store_.release(id);
    Job job;
    job.id = id;
    const Job ended = ended_job(job, WorkEnd::failed(failure), readers_);
    while (!store_.end(ended).ok()) {
        std::unique_lock waiting(mutex_);
        changed_.wait_for(waiting, kFirstWait);
        if (draining_ || ends_) break;
    }
    lock.lock();
    running_.clear();
    remaining_s_ = limit_s_ = 0;
    if (*lost_ >= kMaxLost)
        state_.trouble = concat(kMaxLost, " frames hang in disks or devices; restart the service");
    else if (Status status = take_on(); !status.ok())
        state_.trouble = status.message();
    state_.works = hand_ != nullptr;
    changed_.notify_all();
}

// ------------------------------------------------------------------------------ the thread

bool Worker::make_device(Hand& hand) {
    hand.gl.reset();
    auto made = GlDevice::create(settings_.device, registry_);
    if (made.ok()) hand.gl = std::move(*made);
    if (hand.gl) counters_.set_renderer(hand.gl->renderer());
    const std::lock_guard lock(mutex_);
    state_.works = hand.gl != nullptr;
    state_.renderer = hand.gl ? hand.gl->renderer() : "";
    state_.trouble = made.status().message();
    if (!made_) first_ = made.status();
    made_ = true;
    changed_.notify_all();
    return hand.gl != nullptr;
}

void Worker::loop(Hand& hand) {
    // Threads of this one inherit it, those of a software renderer too.
    (void)setpriority(PRIO_PROCESS, 0, kNice);
    make_device(hand);
    while (next_job(hand)) {
    }
    hand.gl.reset();
}

// False if the thread shall end.
bool Worker::next_job(Hand& hand) noexcept {
    try {
        {
            std::unique_lock lock(mutex_);
            if (draining_) changed_.wait(lock, [&] { return ends_; });
            if (ends_ || hand.lost) return false;
            awake_ = false;
        }
        if (!hand.gl && !make_device(hand)) {
            wait_longer(hand);
            return true;
        }
        const auto job = store_.next(-kMaxPriority);
        if (!job.ok()) {
            set_trouble(job.status().message());
            wait_longer(hand);
            return true;
        }
        hand.wait = kFirstWait;
        if (*job) {
            work(hand, **job);
            return !hand.lost;
        }
        std::unique_lock lock(mutex_);
        changed_.wait(lock, [&] { return ends_ || draining_ || awake_; });
    } catch (...) {
        // Out of memory at a place without a Status; a later turn may succeed.
        const std::lock_guard lock(mutex_);
        if (hand.lost) return false;
        running_.clear();
        changed_.notify_all();
    }
    return true;
}

// Called after a failure.
void Worker::wait_longer(Hand& hand) {
    std::unique_lock lock(mutex_);
    changed_.wait_for(lock, hand.wait, [&] { return ends_ || draining_; });
    hand.wait = std::min<std::chrono::milliseconds>(2 * hand.wait, kLongestWait);
}

// The running job's question, on its thread.
RunDecision Worker::turn(Hand& hand) {
    const RunDecision turn = gate_.ask();
    counters_.waited_for_previews(hand.progress.waits(turn == RunDecision::wait));
    return turn;
}

// Makes way for a job of larger priority, and after a slice of time for one of another user.
void Worker::between(Hand& hand, const Job& job) {
    if (hand.stop) return;
    const auto now = store_.job(job.id);  // its priority may have been changed
    if (!now.ok() || !*now) return;
    const int priority = (*now)->priority;
    const auto next = store_.next(priority);
    if (!next.ok() || !*next) return;
    // ab and bench would lose what they have measured.
    const bool in_parts = job.kind == JobKind::run || job.kind == JobKind::study;
    const bool slice_over =
        in_parts &&
        std::chrono::duration<double>(Clock::now() - hand.began).count() > settings_.slice_s;
    if ((*next)->priority == priority && ((*next)->owner == job.owner || !slice_over)) return;
    hand.preempted = true;
    hand.stop = true;
}

WorkEnd Worker::work_on(Hand& hand, const Job& job, int attempts) {
    auto read = readers_.read(job);
    if (!read.ok()) return WorkEnd::failed(read.status());
    JobRequest& request = read->request;
    if (request.frame_timeout_s > 0) {
        const std::lock_guard lock(mutex_);
        if (!hand.lost) limit_s_ = request.frame_timeout_s;
    }
    const auto ask = [&] { return turn(hand); };
    const ContinueScope turns(hand.gl->executor(), ask);
    const WorkPlace place{store_,
                          read->reader,
                          *hand.gl,
                          counters_,
                          settings_.device,
                          hand.stop,
                          hand.lost,
                          hand.progress,
                          ask,
                          [&] {
                              if (!hand.lost) between(hand, job);
                          },
                          [&](double seconds) {
                              const std::lock_guard lock(mutex_);
                              if (!hand.lost) remaining_s_ = seconds;
                          }};
    WorkEnd end = request.kind == JobKind::run     ? work_on_frames(job, request, place)
                  : request.kind == JobKind::study ? work_on_study(job, request, place)
                                                   : work_on_experiment(job, request, place);
    if (request.kind != JobKind::run && !hand.lost)
        (void)store_.has_written(job.id, bytes_of_report(request));
    if (end.how == WorkEnd::How::gl_failed && request.kind != JobKind::run &&
        attempts >= settings_.attempts)
        end = WorkEnd::failed(Status(StatusCode::gl, end.message));
    return end;
}

// True if the store has recorded it.
bool Worker::enter_end(const Hand& hand, const Job& job, const WorkEnd& end) {
    Status status;
    switch (end.how) {
        case WorkEnd::How::ended:
            status = store_.end(ended_job(job, end, readers_));
            break;
        case WorkEnd::How::stopped:
            status = store_.requeue(job.id, hand.preempted ? "another job goes first" : "stopped",
                                    false);
            break;
        case WorkEnd::How::gl_failed:
            status = store_.requeue(job.id, end.message, job.kind != JobKind::run);
            break;
        case WorkEnd::How::store_failed:
            status = store_.requeue(job.id, end.message, false);
            break;
    }
    set_trouble(status.message());
    return status.ok();
}

void Worker::work(Hand& hand, const Job& job) {
    {
        const std::lock_guard lock(mutex_);
        if (draining_) return;
        running_ = job.id;
        remaining_s_ = 0;
        limit_s_ = settings_.frame_timeout_s;
        hand.stop = false;
        hand.preempted = false;
        hand.began = Clock::now();
        hand.progress.does("the job was not read");
    }
    WorkEnd end;
    try {
        const auto attempts = store_.start(job.id);
        if (!attempts.ok())
            end = WorkEnd::of(WorkEnd::How::store_failed, attempts.status().message());
        else if (*attempts == 0)
            end = WorkEnd::of(WorkEnd::How::stopped, "");  // canceled just now
        else
            end = work_on(hand, job, *attempts);
    } catch (...) {
        end = WorkEnd::failed(status_of_exception("job " + job.id));
    }
    hand.progress.does("");
    {
        // From here on the watcher finds no step.
        const std::lock_guard lock(mutex_);
        if (hand.lost) return;
        limit_s_ = 0;
    }
    if (end.how == WorkEnd::How::store_failed) {
        set_trouble(end.message);
        wait_longer(hand);
    }
    // Until its end is recorded, the job stays with this thread; a next process would resume it.
    while (!enter_end(hand, job, end)) {
        wait_longer(hand);
        const std::lock_guard lock(mutex_);
        if (draining_ || ends_) break;
    }
    if (end.how == WorkEnd::How::gl_failed) hand.gl.reset();
    const std::lock_guard lock(mutex_);
    if (hand.lost) return;
    running_.clear();
    remaining_s_ = 0;
    changed_.notify_all();
}

}  // namespace postchain::service
