#include "tools/service/work/service.h"

#include <csignal>
#include <filesystem>
#include <functional>

#include "config/describe.h"
#include "config/schema.h"
#include "tools/sequence/record/frame_report.h"
#include "tools/sequence/run/device.h"
#include "tools/service/work/browse.h"
#include "tools/service/work/planned.h"
#include "tools/service/work/remote_backend.h"
#include "tools/service/work/service_state.h"
#include "tools/service/work/submission.h"
#include "tools/service/work/worker.h"

namespace postchain::service {
namespace {

constexpr size_t kMaxKeyBytes = 255;

void check_priority(const User& user, int priority) {
    if (priority > user.max_priority)
        throw Problem{Problem::Kind::forbidden,
                      concat("priority: the largest of ", user.name, " is ", user.max_priority)};
}

// Those of the roots, and the store's.
std::vector<std::string> folders_of(const ServiceSettings& settings) {
    std::vector<std::string> folders = settings.roots.folders();
    const auto beside = std::filesystem::path(settings.store).parent_path();
    folders.push_back(beside.empty() ? "." : beside.string());
    return folders;
}

// Does the work, which calls `done` later unless it throws a Problem.
template <class Work>
void refuse(const std::function<void(Answer<Picture>)>& done, const Work& work) {
    try {
        work();
    } catch (const Problem& refused) {
        done(refused);
    }
}

}  // namespace

Service::Service(std::unique_ptr<State> state) : state_(std::move(state)) {}

Service::~Service() {
    // A thread that hangs goes on using it when its disk answers.
    if (state_ && end() > 0) (void)state_.release();
}

size_t Service::end() {
    state_->draining = true;
    const size_t lost = state_->backend ? state_->backend->end() : 0;
    return lost + state_->previews.end() + state_->thumbnails.end() + state_->disks.end();
}

Result<std::unique_ptr<Service>> Service::open(const ServiceSettings& settings,
                                               const PassRegistry& registry) try {
    ASSIGN_OR_RETURN(auto device,
                     sequence::choose_device(settings.device, settings.threads, settings.warn));
    auto state = std::make_unique<State>(settings, registry, device, folders_of(settings));
    ASSIGN_OR_RETURN(state->store,
                     JobStore::open(settings.store, settings.attempts, settings.keep));
    state->log = std::make_unique<JobLog>(*state->store, state->counters, settings.log);
    if (settings.log)
        state->store->on_loss([log = settings.log](const std::string& text) {
            log({LogLine::Level::error, text, {{"event", "store"}}});
        });
    state->store->on_event([at = state.get()](const Event& event) { at->hear(event); });
    if (settings.remote.queue) {
        RemoteSettings remote = settings.remote;
        remote.attempts = settings.attempts;
        remote.drain = settings.drain;
        state->backend = std::make_unique<RemoteBackend>(*state->store, state->readers, remote);
    } else {
        WorkerSettings work;
        work.device = device;
        work.attempts = settings.attempts;
        work.frame_timeout_s = settings.frame_timeout_s;
        work.slice_s = settings.slice_s;
        work.drain = settings.drain;
        state->backend = std::make_unique<Worker>(*state->store, state->readers, state->counters,
                                                  state->gate, registry, work);
    }
    for (const Status& status : {state->thumbnails.begin(), state->previews.begin(),
                                 state->disks.begin(), state->backend->begin()})
        if (!status.ok()) return status;
    return std::unique_ptr<Service>(new Service(std::move(state)));
} catch (...) {
    return status_of_exception("the service");
}

void Service::drain() {
    state_->draining = true;
    state_->backend->drain();
}

bool Service::alive() const {
    const BackendState state = state_->backend->state();
    return state.works || state.lost == 0;
}

Answer<Job> Service::submit(const User& user, const std::string& body,
                            const std::string& idempotency_key, bool* created) {
    *created = false;
    return answer([&] {
        if (state_->draining)
            throw Problem{Problem::Kind::unavailable,
                          "the service is shutting down; try again later",
                          {},
                          kRetryAfterS};
        if (idempotency_key.size() > kMaxKeyBytes)
            throw Problem{Problem::Kind::invalid,
                          concat("the Idempotency-Key is longer than ", kMaxKeyBytes, " bytes")};
        // Each user's keys are their own.
        const std::string key = idempotency_key.empty() || user.name.empty()
                                    ? idempotency_key
                                    : user.name + "\n" + idempotency_key;
        // An accepted body is not checked again.
        const auto earlier = stored(state_->store->job_of_key(key));
        if (earlier && earlier->body == body && earlier->owner == user.name)
            return state_->shown(*earlier);
        const Submission job = taken(check_submission(body, state_->reader_of(user),
                                                      state_->settings.remote.queue != nullptr));
        check_priority(user, job.priority);
        Added added = stored(state_->store->add({job.kind, body, job.priority, key, job.frames},
                                                state_->settings.max_queue, user));
        switch (added.what) {
            case Added::What::made:
                *created = true;
                state_->backend->wake();
                added.job.message = joined(job.warnings, "; ");
                break;
            case Added::What::same:
                break;
            case Added::What::other_body:
                throw Problem{Problem::Kind::conflict,
                              "job " + added.job.id +
                                  " has this Idempotency-Key and another body; use a new key"};
            case Added::What::over_limit:
            case Added::What::full:
                throw Problem{Problem::Kind::busy, added.why, {}, kRetryAfterS};
        }
        return state_->shown(std::move(added.job));
    });
}

Answer<std::vector<Job>> Service::jobs(const JobQuery& query) const {
    return answer([&] {
        auto jobs = stored(
            state_->store->jobs(query.state, query.before, query.limit, query.owner, query.search));
        const QueuePlaces places = stored(state_->store->places());
        for (Job& job : jobs) job = state_->shown(std::move(job), places);
        return jobs;
    });
}

Answer<Job> Service::job(const std::string& id) const {
    return answer([&] { return state_->known(id); });
}

Answer<std::vector<JobFrame>> Service::frames(const std::string& id) const {
    return answer([&] {
        state_->known(id);
        auto frames = stored(state_->store->frames(id));
        for (JobFrame& frame : frames) frame.output = state_->settings.roots.shown(frame.output);
        return frames;
    });
}

Answer<JobFrame> Service::frame(const std::string& id, int number) const {
    return answer([&] {
        JobFrame frame = state_->known(id, number);
        const Roots& roots = state_->settings.roots;
        if (frame.state == FrameState::written || frame.state == FrameState::skipped)
            frame.sidecar = sidecar_of(frame.output, roots);
        frame.output = roots.shown(frame.output);
        return frame;
    });
}

Answer<Job> Service::cancel(const User& user, const std::string& id) {
    return answer([&] {
        const char* why_not = "; only waiting and running jobs can be canceled";
        return state_->change(user, id, why_not, [&](const Job&) {
            const bool done = stored(state_->store->cancel(id, sequence::kExitSignal + SIGTERM));
            if (done) state_->backend->stop_job(id);
            return done;
        });
    });
}

Answer<Job> Service::retry(const User& user, const std::string& id) {
    return answer([&] {
        const char* why_not = "; only failed and canceled jobs can be retried";
        return state_->change(user, id, why_not, [&](const Job& job) {
            const KnownUser owner = state_->settings.users->named(job.owner);
            const Retried retried =
                stored(state_->store->retry(id, owner ? *owner : user, state_->settings.max_queue));
            if (!retried.why.empty())
                throw Problem{Problem::Kind::busy, retried.why, {}, kRetryAfterS};
            if (retried.done) state_->backend->wake();
            return retried.done;
        });
    });
}

Answer<Job> Service::change(const User& user, const std::string& id, const std::string& body) {
    return answer([&] {
        const int priority = taken(read_priority(body, state_->settings.roots));
        check_priority(user, priority);
        const char* why_not = "; only waiting and running jobs have a priority";
        return state_->change(user, id, why_not, [&](const Job&) {
            const bool done = stored(state_->store->set_priority(id, priority));
            if (done) state_->backend->wake();
            return done;
        });
    });
}

Answer<Job> Service::forget(const User& user, const std::string& id) {
    return answer([&] {
        const char* why_not = state_->settings.remote.queue
                                  ? "; cancel it first, and wait until its tasks are canceled too"
                                  : "; cancel it first";
        return state_->change(user, id, why_not,
                              [&](const Job&) { return stored(state_->store->forget(id)); });
    });
}

Answer<std::vector<Event>> Service::events(const std::string& id, int64_t after,
                                           size_t limit) const {
    return answer([&] {
        if (!id.empty()) state_->known(id);
        return stored(state_->store->events(id, after, limit));
    });
}

Answer<ResultFile> Service::report_file(const User& user, const std::string& id,
                                        const std::string& name) const {
    return answer(
        [&] { return taken(report_file_of(state_->known(id), name, state_->reader_of(user))); });
}

Answer<std::vector<ResultFile>> Service::outputs(const User& user, const std::string& id, int first,
                                                 int last) const {
    return answer([&] {
        state_->known(id);
        return taken(outputs_of(stored(state_->store->frames(id)), first, last,
                                state_->reader_of(user).roots()));
    });
}

void Service::on_event(std::function<void(const Event&)> listener) {
    const std::lock_guard lock(state_->listener_mutex);
    state_->listener = std::move(listener);
}

void Service::preview(const User& user, const std::string& body, const PreviewWanted& wanted,
                      std::function<void(Answer<Picture>)> done) {
    refuse(done, [&] {
        const JobReader reader = state_->reader_of(user);
        JobRequest request = taken(reader.preview(body));
        PreviewWanted of_user = wanted;
        if (!wanted.session.empty()) of_user.session = user.name + "\n" + wanted.session;
        if (!state_->previews.run(std::move(request), reader.roots(), of_user, done))
            throw Problem{Problem::Kind::busy, "too many previews are waiting; try again", {}, 1};
    });
}

void Service::frame_image(const User& user, const std::string& id, int frame, bool after,
                          const ImageWanted& wanted, std::function<void(Answer<Picture>)> done) {
    refuse(done, [&] {
        state_->show(
            user, wanted, done,
            [job = state_->known(id), entry = state_->known(id, frame),
             after](const JobReader& reader) { return shown_frame(job, entry, after, reader); });
    });
}

void Service::job_image(const User& user, const std::string& id, const ImageWanted& wanted,
                        std::function<void(Answer<Picture>)> done) {
    refuse(done, [&] {
        state_->show(user, wanted, done,
                     [job = state_->known(id), frames = stored(state_->store->frames(id))](
                         const JobReader& reader) { return shown_frame(job, frames, reader); });
    });
}

void Service::input_image(const User& user, const std::string& input, int frame,
                          const ImageWanted& wanted, std::function<void(Answer<Picture>)> done) {
    refuse(done, [&] {
        state_->show(user, wanted, done, [input, frame](const JobReader& reader) {
            return input_frame(input, frame, reader.roots());
        });
    });
}

Answer<std::string> Service::browse(const User& user, const std::string& folder) const {
    return answer([&] { return taken(service::browse(folder, state_->reader_of(user).roots())); });
}

Answer<std::string> Service::chains(const User& user, const std::string& file) const {
    return answer([&] { return taken(chains_of(file, state_->reader_of(user).roots())); });
}

Answer<std::string> Service::plan(const User& user, const std::string& body) {
    return answer([&] { return taken(plan_of(body, state_->reader_of(user))); });
}

Answer<Diagnostics> Service::check_chain(const std::string& body) const {
    return chain_faults(body, state_->registry);
}

std::string Service::passes() const {
    return passes_as_json(state_->registry);
}

std::string Service::chain_schema() const {
    return postchain::chain_schema(state_->registry);
}

io::Json Service::job_schema() const {
    return service::job_schema(state_->reader.run_table());
}

Health Service::health() {
    // A preview may take long; then the answer is the last known state.
    const std::optional<Status> tested = state_->previews.test();
    const BackendState backend = state_->backend->state();
    const Status status = tested.value_or(Status());
    Health health;
    const auto say = [&](const std::string& text) {
        if (!text.empty()) health.why += (health.why.empty() ? "" : "; ") + text;
    };
    health.renderer = backend.renderer;
    health.draining = state_->draining;
    health.gl = backend.works && status.ok();
    say(status.ok() ? backend.trouble : status.message());
    health.progress =
        alive() && (backend.step_limit_s <= 0 || backend.oldest_step_s <= backend.step_limit_s);
    if (!health.progress && backend.trouble.empty())
        say(concat("a step of the running job takes ", int64_t(backend.oldest_step_s), " s"));
    if (backend.lost > 0)
        say(concat(backend.lost == 1 ? "1 thread hangs" : concat(backend.lost, " threads hang"),
                   " in a disk or a device"));
    const Status in_place = state_->store->in_place();
    say(in_place.message());
    const std::string fault = state_->disks.fault();
    say(fault);
    health.disk = in_place.ok() && fault.empty();
    const auto counts = state_->store->counts();
    const auto queued = counts.find(JobState::queued);
    health.queue =
        !health.draining && (queued == counts.end() || queued->second < state_->settings.max_queue);
    if (health.draining)
        say("the service is shutting down");
    else if (!health.queue)
        say("the queue is full");
    health.why = state_->settings.roots.shown_in(health.why);
    return health;
}

std::string Service::metrics() const {
    const BackendState backend = state_->backend->state();
    return state_->counters.text(state_->store->counts(), state_->store->times(),
                                 {backend.lost, backend.replaced, backend.oldest_step_s});
}

}  // namespace postchain::service
