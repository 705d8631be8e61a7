#include "tools/service/work/worker.h"

#include <sys/resource.h>

#include <filesystem>

#include "tools/service/work/frames_work.h"
#include "tools/service/work/helper_threads.h"
#include "tools/service/work/job_files.h"

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
        RETURN_IF_ERROR(start_worker_thread());
        changed_.wait(lock, [&] { return made_; });
        if (!first_.ok()) return first_;
    }
    auto watcher = start_thread([this] { watch(); });
    if (watcher.ok()) watcher_ = std::move(*watcher);
    return watcher.status();
}

// Requires the lock.
Status Worker::start_worker_thread() {
    current_.reset();
    auto made = std::make_shared<WorkerThread>();
    auto thread = start_thread([this, made, lost = lost_] {
        loop(*made);
        if (made->lost) --*lost;
    });
    if (!thread.ok()) return thread.status();
    thread_ = std::move(*thread);
    current_ = std::move(made);
    return Status();
}

void Worker::wake() {
    const std::lock_guard lock(mutex_);
    awake_ = true;
    changed_.notify_all();
}

void Worker::stop_job(const std::string& id) {
    const std::lock_guard lock(mutex_);
    if (running_ == id && current_) current_->stop = true;
}

void Worker::drain() {
    std::unique_lock lock(mutex_);
    draining_ = true;
    if (current_) current_->stop = true;
    changed_.notify_all();
    if (changed_.wait_for(lock, settings_.drain, [&] { return running_.empty(); })) return;
    // The step hangs. The job waits for the next process, without a counted attempt.
    if (!current_) return;
    const std::string id = running_;
    current_->lost = true;
    current_.reset();
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
    if (current_ && !running_.empty())
        if (const auto longest = current_->progress.longest())
            state.oldest_step_s = longest->seconds;
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
        if (!current_) {
            if (*lost_ < kMaxLost) (void)start_worker_thread();
            continue;
        }
        if (running_.empty() || limit_s_ <= 0) continue;
        const auto longest = current_->progress.longest();
        if (longest && longest->seconds > limit_s_) replace_thread(lock, *longest);
    }
}

// Ends the job of a thread whose step hangs, and starts another thread.
void Worker::replace_thread(std::unique_lock<std::mutex>& lock, const Progress::UnderWay& stuck) {
    const std::string id = running_;
    const Status failure = failure_of(stuck, limit_s_);
    current_->stop = true;
    current_->lost = true;
    current_.reset();
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
    else if (Status status = start_worker_thread(); !status.ok())
        state_.trouble = status.message();
    state_.works = current_ != nullptr;
    changed_.notify_all();
}

// ------------------------------------------------------------------------------ the thread

bool Worker::make_device(WorkerThread& self) {
    self.gl.reset();
    auto made = GlDevice::create(settings_.device, registry_);
    if (made.ok()) self.gl = std::move(*made);
    const std::lock_guard lock(mutex_);
    state_.works = self.gl != nullptr;
    state_.renderer = self.gl ? self.gl->renderer() : "";
    state_.trouble = made.status().message();
    if (!made_) first_ = made.status();
    made_ = true;
    changed_.notify_all();
    return self.gl != nullptr;
}

void Worker::loop(WorkerThread& self) {
    // Threads of this one inherit it, those of a software renderer too.
    (void)setpriority(PRIO_PROCESS, 0, kNice);
    make_device(self);
    while (next_job(self)) {
    }
    self.gl.reset();
}

// False if the thread shall end.
bool Worker::next_job(WorkerThread& self) noexcept {
    try {
        {
            std::unique_lock lock(mutex_);
            if (draining_) changed_.wait(lock, [&] { return ends_; });
            if (ends_ || self.lost) return false;
            awake_ = false;
        }
        if (!self.gl && !make_device(self)) {
            wait_longer(self);
            return true;
        }
        const auto job = store_.next(-kMaxPriority);
        if (!job.ok()) {
            set_trouble(job.status().message());
            wait_longer(self);
            return true;
        }
        self.wait = kFirstWait;
        if (*job) {
            work(self, **job);
            return !self.lost;
        }
        std::unique_lock lock(mutex_);
        changed_.wait(lock, [&] { return ends_ || draining_ || awake_; });
    } catch (...) {
        // Out of memory at a place without a Status; a later turn may succeed.
        const std::lock_guard lock(mutex_);
        if (self.lost) return false;
        running_.clear();
        changed_.notify_all();
    }
    return true;
}

// Called after a failure.
void Worker::wait_longer(WorkerThread& self) {
    std::unique_lock lock(mutex_);
    changed_.wait_for(lock, self.wait, [&] { return ends_ || draining_; });
    self.wait = std::min<std::chrono::milliseconds>(2 * self.wait, kLongestWait);
}

// The running job's question, on its thread.
RunDecision Worker::ask_gate(WorkerThread& self) {
    const RunDecision decision = gate_.ask();
    counters_.waited_for_previews(self.progress.waits(decision == RunDecision::wait));
    return decision;
}

// Stops a job whose owner has written too much. Makes way for a job of larger priority, and after
// a slice of time for one of another user.
void Worker::between(WorkerThread& self, const Job& job) {
    if (self.stop) return;
    self.full = check_disk(store_, readers_.owner_of(job));
    if (!self.full.ok()) {
        self.stop = true;
        return;
    }
    const auto now = store_.job(job.id);  // its priority may have been changed
    if (!now.ok() || !*now) return;
    const int priority = (*now)->priority;
    const auto next = store_.next(priority);
    if (!next.ok() || !*next) return;
    // ab and bench would lose what they have measured.
    const bool in_parts = job.kind == JobKind::run || job.kind == JobKind::study;
    const bool slice_over =
        in_parts &&
        std::chrono::duration<double>(Clock::now() - self.began).count() > settings_.slice_s;
    if ((*next)->priority == priority && ((*next)->owner == job.owner || !slice_over)) return;
    self.preempted = true;
    self.stop = true;
}

void Worker::count_bytes(const Job& job, const JobRequest& request) {
    (void)store_.has_written(job.id, bytes_on_disk(request.measurement->report_folder()));
}

WorkEnd Worker::work_on(WorkerThread& self, const Job& job, int attempts) {
    auto read = readers_.read(job);
    if (!read.ok()) return WorkEnd::failed(read.status());
    if (Status full = check_disk(store_, readers_.owner_of(job)); !full.ok())
        return WorkEnd::failed(full);
    JobRequest& request = read->request;
    if (request.frame_timeout_s > 0) {
        const std::lock_guard lock(mutex_);
        if (!self.lost) limit_s_ = request.frame_timeout_s;
    }
    const auto ask = [&] { return ask_gate(self); };
    const ContinueScope turns(self.gl->executor(), ask);
    const WorkContext context{store_,
                              read->reader,
                              *self.gl,
                              counters_,
                              settings_.device,
                              self.stop,
                              self.lost,
                              self.progress,
                              settings_.try_file,
                              ask,
                              [&] {
                                  if (self.lost) return;
                                  if (request.measurement) count_bytes(job, request);
                                  between(self, job);
                              },
                              [&](double seconds) {
                                  const std::lock_guard lock(mutex_);
                                  if (!self.lost) remaining_s_ = seconds;
                              }};
    Measurement* measurement = request.measurement.get();
    WorkEnd end =
        measurement ? measurement->work(job, context) : work_on_frames(job, request, context);
    if (measurement && !self.lost) count_bytes(job, request);
    if (end.how == WorkEnd::How::stopped && !self.full.ok()) end = WorkEnd::failed(self.full);
    if (end.how == WorkEnd::How::gl_failed && measurement && attempts >= settings_.attempts)
        end = WorkEnd::failed(Status(StatusCode::gl, end.message));
    return end;
}

// True if the store has recorded it.
bool Worker::enter_end(const WorkerThread& self, const Job& job, const WorkEnd& end) {
    Status status;
    switch (end.how) {
        case WorkEnd::How::ended:
            status = store_.end(ended_job(job, end, readers_));
            break;
        case WorkEnd::How::stopped:
            status = store_.requeue(job.id, self.preempted ? "another job goes first" : "stopped",
                                    false);
            break;
        case WorkEnd::How::gl_failed:
            status = store_.requeue(job.id, end.message, job.kind != JobKind::run);
            break;
        case WorkEnd::How::store_failed:
            status = store_.release(job.id);  // as after any interruption; it failed then
            if (status.ok()) status = store_.requeue(job.id, end.message, false);
            break;
    }
    set_trouble(status.message());
    return status.ok();
}

void Worker::work(WorkerThread& self, const Job& job) {
    {
        const std::lock_guard lock(mutex_);
        if (draining_) return;
        running_ = job.id;
        remaining_s_ = 0;
        limit_s_ = settings_.frame_timeout_s;
        self.stop = false;
        self.preempted = false;
        self.full = Status();
        self.began = Clock::now();
        self.progress.does("the job was not read");
    }
    WorkEnd end;
    try {
        const auto attempts = store_.start(job.id);
        if (!attempts.ok())
            end = WorkEnd::of(WorkEnd::How::store_failed, attempts.status().message());
        else if (*attempts == 0)
            end = WorkEnd::of(WorkEnd::How::stopped, "");  // canceled just now
        else
            end = work_on(self, job, *attempts);
    } catch (...) {
        end = WorkEnd::failed(status_of_exception("job " + job.id));
    }
    self.progress.does("");
    {
        // From here on the watcher finds no step.
        const std::lock_guard lock(mutex_);
        if (self.lost) return;
        limit_s_ = 0;
    }
    if (end.how == WorkEnd::How::store_failed) {
        set_trouble(end.message);
        wait_longer(self);
    }
    // Until its end is recorded, the job stays with this thread; a next process would resume it.
    while (!enter_end(self, job, end)) {
        wait_longer(self);
        const std::lock_guard lock(mutex_);
        if (draining_ || ends_) break;
    }
    if (end.how == WorkEnd::How::gl_failed) self.gl.reset();
    const std::lock_guard lock(mutex_);
    if (self.lost) return;
    running_.clear();
    remaining_s_ = 0;
    changed_.notify_all();
}

}  // namespace postchain::service
