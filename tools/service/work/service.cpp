#include "tools/service/work/service.h"

#include <atomic>
#include <filesystem>

#include "config/chain_file.h"
#include "config/describe.h"
#include "config/reporter.h"
#include "config/schema.h"
#include "config/text_tree.h"
#include "tools/sequence/run/device.h"
#include "tools/sequence/run/plan_sequence.h"
#include "tools/service/store/job_store.h"
#include "tools/service/work/browse.h"
#include "tools/service/work/disk_check.h"
#include "tools/service/work/helper_threads.h"
#include "tools/service/work/job_files.h"
#include "tools/service/work/job_log.h"
#include "tools/service/work/job_request.h"
#include "tools/service/work/json_body.h"
#include "tools/service/work/preview.h"
#include "tools/service/work/previews.h"
#include "tools/service/work/readers.h"
#include "tools/service/work/remote_backend.h"
#include "tools/service/work/submission.h"
#include "tools/service/work/worker.h"

namespace postchain::service {
namespace {

constexpr size_t kMaxKeyBytes = 255;
constexpr size_t kMaxThumbnails = 256;  // waiting
constexpr int kMaxPlannedFrames = 100;  // per request

Problem problem(Problem::Kind kind, const std::string& detail, int retry_after_s = 0) {
    return {kind, detail, {}, retry_after_s};
}

// An error of the store.
Problem problem_of(const Status& status) {
    return problem(Problem::Kind::unavailable, status.message(), kRetryAfterS);
}

Problem no_job(const std::string& id) {
    return problem(Problem::Kind::not_found, "no job '" + id.substr(0, 40) + "'");
}

std::vector<std::string> folders_of(const ServiceSettings& settings) {
    std::vector<std::string> folders = settings.roots.folders();
    const auto beside = std::filesystem::path(settings.store).parent_path();
    folders.push_back(beside.empty() ? "." : beside.string());
    return folders;
}

}  // namespace

struct Service::State {
    State(const ServiceSettings& s, const PassRegistry& r, const egl::ContextOptions& device)
        : settings(s),
          registry(r),
          reader(settings.roots, registry, settings.version, settings.threads),
          readers(reader, *settings.users),
          counters(settings.version),
          thumbnails(1, kMaxThumbnails),
          previews(device, registry),
          disks(folders_of(settings)) {}

    const ServiceSettings settings;
    const PassRegistry& registry;
    const JobReader reader;
    const Readers readers;
    Counters counters;
    std::unique_ptr<JobStore> store;
    std::unique_ptr<JobLog> log;
    HelperThreads thumbnails;
    Previews previews;
    DiskCheck disks;
    std::unique_ptr<Backend> backend;
    std::atomic<bool> draining = false;
    std::mutex listener_mutex;
    std::function<void(const Event&)> listener;

    // A job of the store with the remaining time of the running job, or its place in the queue.
    Job shown(Job job, const QueuePlaces& places) const {
        job.remaining_s = backend->remaining_s(job.id);
        const auto place = places.find(job.id);
        if (place != places.end()) job.place = place->second;
        return job;
    }
    Job shown(Job job) const {
        if (job.state != JobState::queued) return shown(std::move(job), {});
        const auto places = store->places();
        return shown(std::move(job), places.ok() ? *places : QueuePlaces());
    }

    void hear(const Event& event) {
        log->enter(event);
        const std::lock_guard lock(listener_mutex);
        if (listener) listener(event);
    }

    // A job that the user may change.
    Answer<Job> own(const User& user, const std::string& id) const {
        const auto job = store->job(id);
        if (!job.ok()) return problem_of(job.status());
        if (!*job) return no_job(id);
        if (!user.admin && (*job)->owner != user.name)
            return problem(Problem::Kind::forbidden,
                           concat("job ", id, " is of ",
                                  (*job)->owner.empty() ? "another user" : (*job)->owner,
                                  "; only its owner and administrators may change it"));
        return std::move(**job);
    }

    // Sends an image of a file, which `find` returns with its frame, from another thread.
    template <class Find>
    void show(const User& user, const ImageWanted& wanted,
              std::function<void(Answer<Picture>)> done, const Find& find) {
        const auto of_user = readers.of(user);
        if (!of_user.ok())
            return done(problem(Problem::Kind::forbidden, of_user.status().message()));
        const bool taken = thumbnails.run([reader = *of_user, wanted, done, find] {
            Answer<Picture> answer = Problem{};
            try {
                const auto [shown, frame] = find(reader);
                if (const auto* refused = std::get_if<Problem>(&shown)) return done(*refused);
                const auto& [path, source] = std::get<ShownFrame>(shown);
                auto bytes = image_of(path, frame, source, wanted);
                if (bytes.ok())
                    answer = Picture{wanted.type, std::move(*bytes)};
                else
                    answer = service::problem_of(bytes.status(), reader.roots());
            } catch (...) {
                answer = service::problem_of(status_of_exception("the image"), reader.roots());
            }
            done(std::move(answer));
        });
        if (!taken) done(problem(Problem::Kind::busy, "too many images are waiting; try again", 1));
    }

    // Changes a job with `work`, which returns false if its state does not allow it.
    template <class Work>
    Answer<Job> change(const User& user, const std::string& id, const std::string& why_not,
                       const Work& work) {
        auto job = own(user, id);
        if (std::holds_alternative<Problem>(job)) return job;
        const Result<bool> done = work();
        if (!done.ok()) return problem_of(done.status());
        if (!*done)
            return problem(Problem::Kind::conflict,
                           concat("job ", id, " is ", name_of(std::get<Job>(job).state), why_not));
        const auto now = store->job(id);
        if (!now.ok()) return problem_of(now.status());
        return *now ? shown(std::move(**now)) : std::get<Job>(job);
    }
};

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
    auto device = sequence::context_options_of(settings.device, settings.threads, settings.warn);
    if (!device.ok()) return device.status();
    auto state = std::make_unique<State>(settings, registry, *device);
    auto store = JobStore::open(settings.store, settings.attempts, settings.keep);
    if (!store.ok()) return store.status();
    state->store = std::move(*store);
    state->log = std::make_unique<JobLog>(*state->store, state->counters, settings.log);
    if (settings.log)
        state->store->on_loss([log = settings.log](const std::string& text) {
            log({LogLine::Level::error, text, {{"event", "store"}}});
        });
    state->store->on_event([at = state.get()](const Event& event) { at->hear(event); });
    if (settings.remote.queue) {
        RemoteSettings remote = settings.remote;
        remote.attempts = settings.attempts;
        state->backend = std::make_unique<RemoteBackend>(*state->store, state->readers, remote);
    } else {
        WorkerSettings work;
        work.device = *device;
        work.attempts = settings.attempts;
        work.frame_timeout_s = settings.frame_timeout_s;
        work.slice_s = settings.slice_s;
        state->backend = std::make_unique<Worker>(*state->store, state->readers, state->counters,
                                                  registry, work);
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
    if (state_->draining)
        return problem(Problem::Kind::unavailable, "the service is shutting down; try again later",
                       kRetryAfterS);
    if (idempotency_key.size() > kMaxKeyBytes)
        return problem(Problem::Kind::invalid,
                       concat("the Idempotency-Key is longer than ", kMaxKeyBytes, " bytes"));
    // An accepted body is not checked again.
    const auto earlier = state_->store->job_of_key(idempotency_key);
    if (!earlier.ok()) return problem_of(earlier.status());
    if (*earlier && (*earlier)->body == body && (*earlier)->owner == user.name) return **earlier;
    const auto reader = state_->readers.of(user);
    if (!reader.ok()) return problem(Problem::Kind::forbidden, reader.status().message());
    const auto checked = check_submission(body, *reader, state_->settings.remote.queue != nullptr);
    if (const auto* refused = std::get_if<Problem>(&checked)) return *refused;
    const Submission& job = std::get<Submission>(checked);
    if (job.priority > user.max_priority)
        return problem(Problem::Kind::forbidden,
                       concat("priority: the largest of ", user.name, " is ", user.max_priority));
    auto added = state_->store->add({job.kind, body, job.priority, idempotency_key, job.frames},
                                    state_->settings.max_queue, user);
    if (!added.ok()) return problem_of(added.status());
    switch (added->what) {
        case Added::What::made:
            *created = true;
            state_->backend->wake();
            added->job.message = joined(job.warnings, "; ");
            return state_->shown(std::move(added->job));
        case Added::What::same:
            return added->job;
        case Added::What::other_body:
            return problem(Problem::Kind::conflict, "job " + added->job.id +
                                                        " has this Idempotency-Key and another "
                                                        "body; use a new key");
        case Added::What::over_limit:
            return problem(Problem::Kind::busy, added->why, kRetryAfterS);
        case Added::What::full:
            break;
    }
    return problem(Problem::Kind::busy,
                   concat(state_->settings.max_queue, " jobs are waiting; try again later"),
                   kRetryAfterS);
}

Answer<std::vector<Job>> Service::jobs(const JobQuery& query) const {
    auto jobs =
        state_->store->jobs(query.state, query.before, query.limit, query.owner, query.search);
    if (!jobs.ok()) return problem_of(jobs.status());
    const auto places = state_->store->places();
    if (!places.ok()) return problem_of(places.status());
    for (Job& job : *jobs) job = state_->shown(std::move(job), *places);
    return std::move(*jobs);
}

Answer<Job> Service::job(const std::string& id) const {
    const auto job = state_->store->job(id);
    if (!job.ok()) return problem_of(job.status());
    if (!*job) return no_job(id);
    return state_->shown(std::move(**job));
}

Answer<std::vector<JobFrame>> Service::frames(const std::string& id) const {
    const auto known = job(id);
    if (const auto* refused = std::get_if<Problem>(&known)) return *refused;
    auto frames = state_->store->frames(id);
    if (!frames.ok()) return problem_of(frames.status());
    for (JobFrame& frame : *frames) frame.output = state_->settings.roots.shown(frame.output);
    return std::move(*frames);
}

Answer<JobFrame> Service::frame(const std::string& id, int number) const {
    const auto known = job(id);
    if (const auto* refused = std::get_if<Problem>(&known)) return *refused;
    auto frame = state_->store->frame(id, number);
    if (!frame.ok()) return problem_of(frame.status());
    if (!*frame)
        return problem(Problem::Kind::not_found, concat("job ", id, " has no frame ", number));
    const Roots& roots = state_->settings.roots;
    if ((*frame)->state == FrameState::written || (*frame)->state == FrameState::skipped)
        (*frame)->sidecar = sidecar_of((*frame)->output, roots);
    (*frame)->output = roots.shown((*frame)->output);
    return std::move(**frame);
}

Answer<Job> Service::cancel(const User& user, const std::string& id) {
    return state_->change(user, id, "; only waiting and running jobs can be canceled", [&] {
        const auto done = state_->store->cancel(id);
        if (done.ok() && *done) state_->backend->stop_job(id);
        return done;
    });
}

Answer<Job> Service::retry(const User& user, const std::string& id) {
    const auto job = state_->own(user, id);
    if (const auto* refused = std::get_if<Problem>(&job)) return *refused;
    const KnownUser owner = state_->settings.users->named(std::get<Job>(job).owner);
    Retried retried;
    auto answer = state_->change(
        user, id, "; only failed and canceled jobs can be retried", [&]() -> Result<bool> {
            const auto done = state_->store->retry(id, owner ? *owner : user);
            if (!done.ok()) return done.status();
            retried = *done;
            if (retried.done) state_->backend->wake();
            return retried.done;
        });
    if (!retried.why.empty()) return problem(Problem::Kind::busy, retried.why, kRetryAfterS);
    return answer;
}

Answer<Job> Service::change(const User& user, const std::string& id, const std::string& body) {
    const auto priority = read_priority(body, state_->settings.roots);
    if (const auto* refused = std::get_if<Problem>(&priority)) return *refused;
    if (std::get<int>(priority) > user.max_priority)
        return problem(Problem::Kind::forbidden,
                       concat("priority: the largest of ", user.name, " is ", user.max_priority));
    return state_->change(user, id, "; only waiting and running jobs have a priority", [&] {
        const auto done = state_->store->set_priority(id, std::get<int>(priority));
        if (done.ok() && *done) state_->backend->wake();
        return done;
    });
}

Answer<Job> Service::forget(const User& user, const std::string& id) {
    const char* why_not = state_->settings.remote.queue
                              ? "; cancel it first, and wait until its tasks are canceled too"
                              : "; cancel it first";
    return state_->change(user, id, why_not, [&] { return state_->store->forget(id); });
}

Answer<std::vector<Event>> Service::events(const std::string& id, int64_t after,
                                           size_t limit) const {
    if (!id.empty()) {
        const auto known = job(id);
        if (const auto* refused = std::get_if<Problem>(&known)) return *refused;
    }
    auto events = state_->store->events(id, after, limit);
    if (!events.ok()) return problem_of(events.status());
    return std::move(*events);
}

void Service::on_event(std::function<void(const Event&)> listener) {
    const std::lock_guard lock(state_->listener_mutex);
    state_->listener = std::move(listener);
}

void Service::preview(const User& user, const std::string& body, const PreviewWanted& wanted,
                      std::function<void(Answer<Picture>)> done) {
    const auto reader = state_->readers.of(user);
    if (!reader.ok()) return done(problem(Problem::Kind::forbidden, reader.status().message()));
    auto read = reader->preview(body);
    if (const auto* refused = std::get_if<Problem>(&read)) return done(*refused);
    PreviewWanted of_user = wanted;
    if (!wanted.session.empty()) of_user.session = user.name + "\n" + wanted.session;
    if (!state_->previews.run(std::move(std::get<JobRequest>(read)), reader->roots(), of_user,
                              done))
        done(problem(Problem::Kind::busy, "too many previews are waiting; try again", 1));
}

void Service::frame_image(const User& user, const std::string& id, int frame, bool after,
                          const ImageWanted& wanted, std::function<void(Answer<Picture>)> done) {
    const auto known = job(id);
    if (const auto* refused = std::get_if<Problem>(&known)) return done(*refused);
    const auto entry = state_->store->frame(id, frame);
    if (!entry.ok()) return done(problem_of(entry.status()));
    if (!*entry)
        return done(problem(Problem::Kind::not_found, concat("job ", id, " has no frame ", frame)));
    state_->show(user, wanted, std::move(done),
                 [job = std::get<Job>(known), entry = **entry, after](const JobReader& reader) {
                     return std::pair(shown_frame(job, entry, after, reader), entry.frame);
                 });
}

void Service::job_image(const User& user, const std::string& id, const ImageWanted& wanted,
                        std::function<void(Answer<Picture>)> done) {
    const auto known = job(id);
    if (const auto* refused = std::get_if<Problem>(&known)) return done(*refused);
    const auto frames = state_->store->frames(id);
    if (!frames.ok()) return done(problem_of(frames.status()));
    state_->show(user, wanted, std::move(done),
                 [job = std::get<Job>(known), frames = *frames](const JobReader& reader) {
                     return std::pair(shown_frame(job, frames, reader), 0);
                 });
}

void Service::input_image(const User& user, const std::string& input, int frame,
                          const ImageWanted& wanted, std::function<void(Answer<Picture>)> done) {
    state_->show(user, wanted, std::move(done), [input, frame](const JobReader& reader) {
        return std::pair(input_frame(input, frame, reader.roots()), frame);
    });
}

Answer<std::string> Service::browse(const User& user, const std::string& folder) const {
    const auto reader = state_->readers.of(user);
    if (!reader.ok()) return problem(Problem::Kind::forbidden, reader.status().message());
    return service::browse(folder, reader->roots());
}

Answer<std::string> Service::chains(const User& user, const std::string& file) const {
    const auto reader = state_->readers.of(user);
    if (!reader.ok()) return problem(Problem::Kind::forbidden, reader.status().message());
    return chains_of(file, reader->roots());
}

Answer<ResultFile> Service::report_file(const User& user, const std::string& id,
                                        const std::string& name) const {
    const auto known = job(id);
    if (const auto* refused = std::get_if<Problem>(&known)) return *refused;
    const auto reader = state_->readers.of(user);
    if (!reader.ok()) return problem(Problem::Kind::forbidden, reader.status().message());
    return report_file_of(std::get<Job>(known), name, *reader);
}

Answer<std::vector<ResultFile>> Service::outputs(const User& user, const std::string& id, int first,
                                                 int last) const {
    const auto known = job(id);
    if (const auto* refused = std::get_if<Problem>(&known)) return *refused;
    const auto frames = state_->store->frames(id);
    if (!frames.ok()) return problem_of(frames.status());
    const auto reader = state_->readers.of(user);
    if (!reader.ok()) return problem(Problem::Kind::forbidden, reader.status().message());
    return outputs_of(*frames, first, last, reader->roots());
}

Answer<std::string> Service::plan(const User& user, const std::string& body) {
    const auto reader = state_->readers.of(user);
    if (!reader.ok()) return problem(Problem::Kind::forbidden, reader.status().message());
    auto read = reader->plan(body);
    if (const auto* refused = std::get_if<Problem>(&read)) return *refused;
    JobRequest& request = std::get<JobRequest>(read);
    const Roots& roots = reader->roots();
    try {
        if (Status status = check_inputs(request.run.input, roots); !status.ok())
            return service::problem_of(status, roots);
        // Plans one frame, unless the request names frames.
        const int most = request.run.frames ? kMaxPlannedFrames : 1;
        io::Json frames = io::Json::array();
        const Status status = sequence::plan_sequence(
            request.chain.chain, request.run, [&](const sequence::PlannedFrame& planned) {
                io::Json frame = {{"frame", planned.frame}};
                if (planned.plan.ok())
                    frame["plan"] = sequence::planned_json(planned, std::nullopt);
                else
                    frame["error"] = roots.shown_in(planned.plan.status().message());
                frame["warnings"] = request.warnings;
                for (const std::string& warning : planned.warnings)
                    frame["warnings"].push_back(roots.shown_in(warning));
                frames.push_back(std::move(frame));
                return int(frames.size()) < most;
            });
        if (!status.ok()) return service::problem_of(status, roots);
        return io::json_text({{"frames", std::move(frames)}});
    } catch (...) {
        return service::problem_of(status_of_exception("the plan"), roots);
    }
}

Answer<Diagnostics> Service::check_chain(const std::string& body) const {
    TextTree tree = read_json_body(body);
    const TextNode* text = tree.root.find("text");
    if (!has_errors(tree.diagnostics) && !(text && is_string(*text)))
        Reporter(kBodyFile, StatusCode::usage, tree.diagnostics)
            .error(text ? *text : tree.root, "text", "missing, or not a chain file's text");
    if (has_errors(tree.diagnostics))
        return refusal(Problem::Kind::invalid, std::move(tree.diagnostics));
    return parse_chain(text->text, "chain", state_->registry).diagnostics;
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
