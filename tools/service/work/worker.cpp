#include "tools/service/work/worker.h"

#include <optional>
#include <system_error>

#include "tools/sequence/run/exit_code.h"
#include "tools/service/work/experiment_work.h"
#include "tools/service/work/frames_work.h"
#include "tools/service/work/study_work.h"

namespace postchain::service {
namespace {

using namespace std::chrono_literals;

constexpr std::chrono::milliseconds kFirstWait = 1s;
constexpr std::chrono::milliseconds kLongestWait = 30s;

}  // namespace

Worker::Worker(JobStore& store, const JobReader& reader, Counters& counters,
               const PassRegistry& registry, const egl::ContextOptions& device, int attempts)
    : store_(store),
      reader_(reader),
      counters_(counters),
      registry_(registry),
      device_options_(device),
      attempts_(attempts),
      wait_(kFirstWait) {}

Worker::~Worker() {
    if (!thread_.joinable()) return;
    drain();
    {
        const std::lock_guard lock(mutex_);
        ends_ = true;
        changed_.notify_all();
    }
    thread_.join();
}

Status Worker::begin() {
    try {
        thread_ = std::thread([this] { loop(); });
    } catch (const std::system_error& error) {
        return Status(StatusCode::internal, std::string("cannot start a thread: ") + error.what());
    }
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return made_; });
    return first_;
}

void Worker::wake() {
    const std::lock_guard lock(mutex_);
    awake_ = true;
    changed_.notify_all();
}

void Worker::stop_job(const std::string& id) {
    const std::lock_guard lock(mutex_);
    if (running_ == id) stop_ = true;
}

void Worker::drain() {
    std::unique_lock lock(mutex_);
    draining_ = true;
    stop_ = true;
    changed_.notify_all();
    changed_.wait(lock, [&] { return running_.empty(); });
}

void Worker::run(Errand errand) {
    {
        const std::lock_guard lock(mutex_);
        if (!ends_) {
            errands_.push_back(std::move(errand));
            changed_.notify_all();
            return;
        }
    }
    errand(nullptr);
}

std::pair<std::string, double> Worker::under_way() const {
    const std::lock_guard lock(mutex_);
    return {running_, remaining_s_};
}

Worker::State Worker::state() const {
    const std::lock_guard lock(mutex_);
    return state_;
}

void Worker::set_trouble(const std::string& text) {
    const std::lock_guard lock(mutex_);
    state_.trouble = text;
}

// ------------------------------------------------------------------------------ the thread

void Worker::run_errands() {
    for (;;) {
        Errand errand;
        {
            const std::lock_guard lock(mutex_);
            if (errands_.empty()) return;
            errand = std::move(errands_.front());
            errands_.pop_front();
        }
        try {
            // An errand between two frames of a job is not stopped with the job.
            std::optional<StopScope> whole;
            if (gl_) whole.emplace(gl_->executor(), nullptr);
            errand(gl_.get());
        } catch (...) {
            // Errands must not throw. If one does, the running job continues.
        }
    }
}

void Worker::pause(std::chrono::milliseconds time) {
    const auto end = Clock::now() + time;
    std::unique_lock lock(mutex_);
    while (!ends_ && !draining_ && Clock::now() < end) {
        changed_.wait_until(lock, end, [&] { return ends_ || draining_ || !errands_.empty(); });
        lock.unlock();
        run_errands();
        lock.lock();
    }
}

bool Worker::make_device() {
    gl_.reset();
    auto made = GlDevice::create(device_options_, registry_);
    if (made.ok()) gl_ = std::move(*made);
    if (gl_) counters_.set_renderer(gl_->renderer());
    const std::lock_guard lock(mutex_);
    state_.gl = gl_ != nullptr;
    state_.renderer = gl_ ? gl_->renderer() : "";
    state_.trouble = made.status().message();
    if (!made_) first_ = made.status();
    made_ = true;
    changed_.notify_all();
    return gl_ != nullptr;
}

void Worker::loop() {
    make_device();
    while (turn()) {
    }
    // Answers the waiting errands.
    gl_.reset();
    run_errands();
}

// False if the thread shall end.
bool Worker::turn() noexcept {
    try {
        run_errands();
        {
            std::unique_lock lock(mutex_);
            if (ends_) return false;
            awake_ = false;
            if (draining_) {
                changed_.wait(lock, [&] { return ends_ || !errands_.empty(); });
                return true;
            }
        }
        if (!gl_ && !make_device()) {
            wait_longer();
            return true;
        }
        const auto job = store_.next(-kMaxPriority);
        if (!job.ok()) {
            set_trouble(job.status().message());
            wait_longer();
            return true;
        }
        wait_ = kFirstWait;
        if (*job) {
            work(**job);
            return true;
        }
        std::unique_lock lock(mutex_);
        changed_.wait(lock, [&] { return ends_ || draining_ || awake_ || !errands_.empty(); });
    } catch (...) {
        // Out of memory at a place without a Status; a later turn may succeed.
        const std::lock_guard lock(mutex_);
        running_.clear();
        changed_.notify_all();
    }
    return true;
}

// Called after a failure.
void Worker::wait_longer() {
    pause(wait_);
    wait_ = std::min<std::chrono::milliseconds>(2 * wait_, kLongestWait);
}

void Worker::between(const Job& job) {
    run_errands();
    if (stop_ || (job.kind != JobKind::run && job.kind != JobKind::study)) return;
    const auto next = store_.next(job.priority + 1);
    if (!next.ok() || !*next) return;
    preempted_ = true;
    stop_ = true;
}

WorkEnd Worker::work_on(const Job& job, int attempts) {
    auto read = reader_.job(job.body);
    if (const auto* problem = std::get_if<Problem>(&read)) {
        const Status status = status_of(problem->diagnostics);
        return WorkEnd::failed(
            Status(status.ok() ? StatusCode::usage : status.code(), problem->detail));
    }
    JobRequest& request = std::get<JobRequest>(read);
    const WorkPlace place{store_,
                          reader_,
                          *gl_,
                          counters_,
                          device_options_,
                          stop_,
                          [&] { between(job); },
                          [&](double seconds) {
                              const std::lock_guard lock(mutex_);
                              remaining_s_ = seconds;
                          }};
    WorkEnd end = request.kind == JobKind::run     ? work_on_frames(job, request, place)
                  : request.kind == JobKind::study ? work_on_study(job, request, place)
                                                   : work_on_experiment(job, request, place);
    if (end.how == WorkEnd::How::gl_failed && request.kind != JobKind::run && attempts >= attempts_)
        end = WorkEnd::failed(Status(StatusCode::gl, end.message));
    return end;
}

// True if the store has recorded it.
bool Worker::enter_end(const Job& job, const WorkEnd& end) {
    Status status;
    switch (end.how) {
        case WorkEnd::How::ended: {
            Job ended = job;
            ended.state = end.state;
            ended.exit_code = end.exit_code;
            ended.message = reader_.roots().shown_in(end.message);
            ended.verdict = end.verdict;
            status = store_.end(ended);
            break;
        }
        case WorkEnd::How::stopped:
            status = store_.requeue(
                job.id, preempted_ ? "a job of higher priority goes first" : "stopped", false);
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

void Worker::work(const Job& job) {
    {
        const std::lock_guard lock(mutex_);
        if (draining_) return;
        running_ = job.id;
        remaining_s_ = 0;
        stop_ = false;
        preempted_ = false;
    }
    WorkEnd end;
    try {
        const auto attempts = store_.start(job.id);
        if (!attempts.ok())
            end = WorkEnd::of(WorkEnd::How::store_failed, attempts.status().message());
        else if (*attempts == 0)
            end = WorkEnd::of(WorkEnd::How::stopped, "");  // canceled just now
        else
            end = work_on(job, *attempts);
    } catch (...) {
        end = WorkEnd::failed(status_of_exception("job " + job.id));
    }
    if (end.how == WorkEnd::How::store_failed) {
        set_trouble(end.message);
        wait_longer();
    }
    // Until its end is recorded, the job stays with this thread; a next process would resume it.
    while (!enter_end(job, end)) {
        wait_longer();
        const std::lock_guard lock(mutex_);
        if (draining_ || ends_) break;
    }
    if (end.how == WorkEnd::How::gl_failed) gl_.reset();
    const std::lock_guard lock(mutex_);
    running_.clear();
    remaining_s_ = 0;
    changed_.notify_all();
}

}  // namespace postchain::service
