#include "tools/service/work/service.h"

#include <algorithm>
#include <cmath>
#include <csignal>
#include <filesystem>
#include <mutex>
#include <optional>
#include <span>
#include <type_traits>
#include <utility>
#include <variant>

#include "chain/base/readable_file.h"
#include "chain/base/text.h"
#include "config/describe.h"
#include "config/schema.h"
#include "tools/sequence/record/frame_report.h"
#include "tools/sequence/source/memory_limit.h"
#include "tools/service/store/job_store.h"
#include "tools/service/work/browse.h"
#include "tools/service/work/counters.h"
#include "tools/service/work/health_watch.h"
#include "tools/service/work/helper_threads.h"
#include "tools/service/work/job_files.h"
#include "tools/service/work/job_request.h"
#include "tools/service/work/job_runner.h"
#include "tools/service/work/local_queue.h"
#include "tools/service/work/previews.h"
#include "tools/service/work/process.h"
#include "tools/service/work/programs.h"

namespace postchain::service {
namespace {

constexpr size_t kMaxKeyBytes = 255;
constexpr size_t kMaxThumbnails = 256;   // waiting
constexpr size_t kThumbnailThreads = 2;  // one user has one of them at a time

// Functions that throw a Problem run in answer().
template <class Work>
auto answer(const Work& work) -> Answer<std::invoke_result_t<Work>> {
    try {
        return work();
    } catch (const Problem& refused) {
        return refused;
    }
}

Problem later(Problem::Kind kind, const std::string& why, int seconds = kRetryAfterS) {
    return {kind, why, {}, seconds};
}

template <class T>
T stored(Result<T> found) {
    if (!found.ok()) throw later(Problem::Kind::unavailable, found.status().message());
    return std::move(*found);
}

template <class T>
T taken(Answer<T> got) {
    if (!got.ok()) throw got.status();
    return std::move(*got);
}

void check_priority(const User& user, int priority) {
    if (priority > user.max_priority)
        throw Problem{Problem::Kind::forbidden,
                      concat("priority: the largest of ", user.name, " is ", user.max_priority)};
}

constexpr auto kLocalPoll = std::chrono::milliseconds(50);

// Those of the roots, and the store's.
std::vector<std::string> folders_of(const ServiceSettings& settings) {
    std::vector<std::string> folders = settings.roots.folders();
    const auto beside = std::filesystem::path(settings.store).parent_path();
    folders.push_back(beside.empty() ? "." : beside.string());
    return folders;
}

// --------------------------------------------------------------------------------- submitted jobs
struct Submission {
    NewJob job;  // without its key
    std::vector<std::string> warnings;
    std::vector<int> written = {};  // frames of a run whose outputs must not exist
};

// Job::about of a job: long texts are cut. `frames`: those that it writes.
std::string about_of(const std::string& body, const Roots& roots, std::span<const int> frames) {
    constexpr size_t kLongest = 300;  // bytes
    const RequestBody text(body, roots);
    io::Json about = io::Json::object();
    for (const char* key : {"input", "output", "chain", "chain_b", "study"})
        if (const TextNode* node = text.find(key); node && is_string(*node))
            about[key] = node->text.substr(0, kLongest);
    if (!frames.empty()) about["frames"] = io::range_text(frames);
    return io::json_text(about);
}

// Problems: those of JobReader::job() and Programs::check().
Answer<Submission> check_submission(const std::string& body, const JobReader& reader,
                                    const Programs& programs) {
    ASSIGN_OR_RETURN(const JobRequest request, reader.job(body));
    ASSIGN_OR_RETURN(CheckedJob found, programs.check(body, request, reader.roots()));
    Submission submission;
    NewJob& job = submission.job;
    job.kind = JobKind(request.kind);
    job.body = body;
    job.priority = request.priority;
    job.frames = found.frames;
    job.writes = std::move(found.writes);
    submission.warnings = std::move(found.warnings);
    const bool is_run = request.kind == RequestKind::run;
    const bool fails = request.value("on_existing", is_run ? "fail" : "") == "fail";
    if (is_run ? fails : found.needs_new_folder) job.output = request.output;
    const auto refused = [](const JobFrame& frame) {
        return frame.state == FrameState::quarantined;
    };
    const auto first = std::ranges::find_if(found.of_run, refused);
    if (fails && first != found.of_run.end()) {
        RequestBody text(body, reader.roots());
        text.fault("on_existing",
                   concat(std::ranges::count_if(found.of_run, refused), " of ", found.frames,
                          " frames have outputs already; ", first->message));
        return text.problem();
    }
    for (const JobFrame& frame : found.of_run)
        if (frame.state == FrameState::waiting) submission.written.push_back(frame.frame);
    job.about = about_of(body, reader.roots(), submission.written);
    return submission;
}

// The refusal of a job whose output `other` is going to write, or nothing. `other`: an unfinished
// job with the same NewJob::output.
std::optional<Problem> same_output(const std::string& body, const Submission& job, const Job& other,
                                   const Roots& roots) {
    const auto refuse = [&](const std::string& what) {
        RequestBody text(body, roots);
        text.fault("on_existing", concat("job ", other.id, " is going to write ", what,
                                         "; name another output, wait for it, or cancel it"));
        return text.problem();
    };
    if (job.job.kind != JobKind::run) return refuse("this report");
    const io::Json about = io::Json::parse(other.about, nullptr, false);
    if (!about.is_object() || !about.contains("frames")) return std::nullopt;
    const auto frames = io::FrameRange::parse(about.at("frames").get<std::string>());
    if (!frames.ok()) return std::nullopt;
    for (const int frame : frames->frames)
        if (std::ranges::binary_search(job.written, frame))
            return refuse(concat("frame ", frame, " to the same file"));
    return std::nullopt;
}

// Does the work, which calls `done` later unless it throws a Problem.
template <class Work>
void refuse(const GivePicture& done, const Work& work) {
    try {
        work();
    } catch (const Problem& refused) {
        done(refused);
    }
}

// --------------------------------------------------------------------------------------- the log
double seconds_between(int64_t from_ms, int64_t to_ms) {
    return from_ms > 0 && to_ms > from_ms ? double(to_ms - from_ms) * 1e-3 : 0;
}

std::string text_of_seconds(double seconds) {
    return concat(std::round(seconds * 10) / 10, " s");
}

std::string value(const io::Json& data, const char* key) {
    const auto found = data.find(key);
    if (found == data.end()) return "";
    return found->is_string() ? found->get<std::string>() : io::json_text(*found);
}

// The log and the counters of jobs, made from the events of the store: a line for each start, end
// and quarantined frame. From any thread. `log` may be empty.
void log_event(const Event& event, const JobStore& store, Counters& counters,
               const std::function<void(const LogLine&)>& log) noexcept try {
    // Every frame is too much for a log; /metrics counts them.
    if (event.type == "frame" || event.type == "progress" || event.type == "frames") return;
    const auto found = store.listed(event.job);
    if (!found.ok() || !*found) return;
    const Job& job = **found;
    const io::Json data = io::Json::parse(event.data, nullptr, false);
    const std::string message = data.is_object() ? value(data, "message") : "";
    LogLine line;
    line.fields = {{"event", event.type}, {"job", job.id}, {"kind", name_of(job.kind)}};
    if (!job.owner.empty()) line.fields["user"] = job.owner;
    const std::string who = job.owner.empty() ? "" : " of " + job.owner;
    const std::string what = concat("job ", job.id, who);
    const auto took = [&](double seconds) {
        line.fields["seconds"] = seconds;
        return text_of_seconds(seconds);
    };
    if (event.type == "started") {
        const double waited = seconds_between(job.created_ms, event.time_ms);
        line.message = concat(what, " started: ", name_of(job.kind), ", priority ", job.priority,
                              ", ", took(waited), " after its submission");
    } else if (event.type == "done" || event.type == "failed" || event.type == "canceled") {
        counters.ended(job.kind, event.type);
        line.fields["frames"] = job.done;
        const std::string when =
            job.started_ms == 0
                ? "before its start"
                : took(seconds_between(job.started_ms, event.time_ms)) + " after its start";
        line.message =
            concat(what, " ", event.type, " ", when, ": ", job.done, " of ", job.frames, " frames");
        if (event.type == "failed") line.level = LogLine::Level::error;
        if (!message.empty()) line.message += "; " + message;
    } else if (event.type == "quarantined" || event.type == "frame_failed") {
        line.level = LogLine::Level::warning;
        line.fields["frame"] = data.is_object() ? data.value("frame", 0) : 0;
        line.message =
            concat(what, ": frame ", value(data, "frame"),
                   event.type == "quarantined" ? " quarantined" : " failed, attempt ",
                   event.type == "quarantined" ? "" : value(data, "attempts"), ": ", message);
    } else if (event.type == "queued") {
        line.message = concat(what, " queued: ", name_of(job.kind), ", priority ", job.priority);
    } else if (event.type == "requeued") {
        line.message = concat(what, " waits again: ", value(data, "why"));
    } else {
        line.message = concat(what, " ", event.type, ": ", io::json_text(data));
    }
    if (log) log(line);
} catch (...) {
    // A lost line must not cost a job.
}

}  // namespace

// ------------------------------------------------------------------------------------- the state
struct Service::State {
    State(const ServiceSettings& s, const PassRegistry& r, Schemas known,
          std::vector<std::string> folders)
        : settings(s),
          registry(r),
          schemas(std::move(known)),
          reader(settings.roots, schemas),
          readers(reader, *settings.users),
          memory(settings.max_memory > 0 ? settings.max_memory : sequence::default_memory_limit()),
          programs(settings.program, folder.path(), kOwnMemory + memory / 2),
          thumbnails(kThumbnailThreads, kMaxThumbnails),
          previews(settings, memory / 4),
          watch(std::move(folders), [this] { return look(); }) {}

    const ServiceSettings settings;
    const PrivateFolder folder{place_of_own_folder()};
    const PassRegistry& registry;
    const Schemas schemas;
    JobReader reader;
    const Readers readers;
    const uint64_t memory;  // bytes of the frames of jobs, previews and images
    const Programs programs;
    Counters counters;
    std::unique_ptr<JobStore> store;
    HelperThreads thumbnails;
    Previews previews;
    std::unique_ptr<JobRunner> runner;
    std::atomic<bool> draining = false;
    std::mutex listener_mutex;
    std::function<void(const Event&)> listener;
    // On the thread of `watch`.
    std::chrono::steady_clock::time_point device_tested = {};
    Status device_state = {};
    std::string renderer;
    HealthWatch watch;  // the last member: it uses the others

    // A job of the store with the remaining time of the running job, or its place in the queue.
    Job shown(Job job, const QueuePlaces& places) const;
    Job shown(Job job) const;

    size_t hanging() const { return thumbnails.hanging() + previews.hanging(); }
    void hear(const Event& event);
    WatchedHealth look();

    // The following throw a Problem.
    Job known(const std::string& id) const;
    void check_known(const std::string& id) const;
    JobFrame known(const std::string& id, int frame) const;
    JobReader reader_of(const User& user) const;
    // Sends an image of a file from another thread. `find` returns the file for a reader.
    using FindFrame = std::function<Answer<ShownFrame>(const JobReader&)>;
    void show(const User& user, const PictureWanted& wanted, const GivePicture& done,
              const FindFrame& find);

    // Changes a job that the user may change with `work`, which returns false if its state does not
    // allow it.
    Job change(const User& user, const std::string& id, const std::string& why_not,
               const std::function<bool(const Job&)>& work);
};

Job Service::State::shown(Job job, const QueuePlaces& places) const {
    job.remaining_s = runner->remaining_s(job.id);
    const auto place = places.find(job.id);
    if (place != places.end()) job.place = place->second;
    return job;
}

Job Service::State::shown(Job job) const {
    if (job.state != JobState::queued) return shown(std::move(job), {});
    const auto places = store->places();
    return shown(std::move(job), places.ok() ? *places : QueuePlaces());
}

void Service::State::hear(const Event& event) {
    log_event(event, *store, counters, settings.log);
    const std::lock_guard lock(listener_mutex);
    if (listener) listener(event);
}

WatchedHealth Service::State::look() {
    constexpr auto kDevicePeriod = std::chrono::seconds(10);
    const auto now = std::chrono::steady_clock::now();
    if (now - device_tested > kDevicePeriod) {
        // A preview may take long; then the device's last known state stays.
        if (auto tested = previews.test()) {
            device_state = tested->status();
            if (tested->ok()) renderer = **tested;
        }
        device_tested = now;
    }
    const auto counts = store->use().jobs;
    const auto queued = counts.find(JobState::queued);
    return {device_state, renderer, store->in_place(), queued == counts.end() ? 0 : queued->second};
}

Job Service::State::known(const std::string& id) const {
    auto job = stored(store->job(id));
    if (!job) throw Problem{Problem::Kind::not_found, "no job '" + id.substr(0, 40) + "'"};
    return shown(std::move(*job));
}

void Service::State::check_known(const std::string& id) const {
    if (!stored(store->listed(id)))
        throw Problem{Problem::Kind::not_found, "no job '" + id.substr(0, 40) + "'"};
}

JobFrame Service::State::known(const std::string& id, int frame) const {
    check_known(id);
    auto found = stored(store->frame(id, frame));
    if (!found) throw not_found(concat("job ", id, " has no frame ", frame));
    return std::move(*found);
}

JobReader Service::State::reader_of(const User& user) const {
    auto own = readers.of(user);
    if (!own.ok()) throw Problem{Problem::Kind::forbidden, own.status().message()};
    return std::move(*own);
}

void Service::State::show(const User& user, const PictureWanted& wanted, const GivePicture& done,
                          const FindFrame& find) {
    const auto make = [this, wanted, reader = reader_of(user), find] {
        try {
            const ShownFrame shown = taken(find(reader));
            auto bytes = image_of(settings.preview_program, shown, reader.roots(), wanted,
                                  memory / 4 / kThumbnailThreads);
            if (!bytes.ok()) throw problem_of(bytes.status(), reader.roots());
            return Picture{wanted.type, std::move(*bytes)};
        } catch (const Problem&) {
            throw;
        } catch (...) {
            throw problem_of(status_of_exception("the image"), reader.roots());
        }
    };
    const Problem busy = later(Problem::Kind::busy, "too many images are waiting; try again", 1);
    const auto work = [done, make, left = wanted.left] {
        if (left && *left) return done(Problem{Problem::Kind::unavailable, "the client has left"});
        done(answer(make));
    };
    if (!thumbnails.run(work, {wanted.share, [done, busy] { done(busy); }, wanted.left}))
        throw busy;
}

Job Service::State::change(const User& user, const std::string& id, const std::string& why_not,
                           const std::function<bool(const Job&)>& work) {
    Job job = known(id);
    if (!user.admin && job.owner != user.name)
        throw Problem{Problem::Kind::forbidden,
                      concat("job ", id, " is of ", job.owner.empty() ? "another user" : job.owner,
                             "; only its owner and administrators may change it")};
    if (!work(job))
        throw Problem{Problem::Kind::conflict,
                      concat("job ", id, " is ", name_of(job.state), why_not)};
    // A job that was just removed is returned as it was.
    return shown(stored(store->job(id)).value_or(std::move(job)));
}

// ----------------------------------------------------------------------------------- the service
Service::Service(std::unique_ptr<State> state) : state_(std::move(state)) {}

Service::~Service() {
    // A thread that hangs goes on using it when its disk answers.
    if (state_ && end() > 0) (void)state_.release();
}

size_t Service::end() {
    state_->draining = true;
    const size_t lost = state_->runner ? state_->runner->end() : 0;
    return lost + state_->watch.end() + state_->previews.end() + state_->thumbnails.end();
}

Result<std::unique_ptr<Service>> Service::open(const ServiceSettings& settings,
                                               const PassRegistry& registry) try {
    confine_files(settings.roots.folders());
    ASSIGN_OR_RETURN(auto schemas, Programs(settings.program, "", 0).schemas(settings.version));
    auto state =
        std::make_unique<State>(settings, registry, std::move(schemas), folders_of(settings));
    ASSIGN_OR_RETURN(state->store,
                     JobStore::open(settings.store, settings.attempts, settings.keep));
    if (settings.log)
        state->store->on_loss([log = settings.log](const std::string& text) {
            log({LogLine::Level::error, text, {{"event", "store"}}});
        });
    state->store->on_event([at = state.get()](const Event& event) { at->hear(event); });
    if (state->folder.path().empty())
        return Status(StatusCode::output, "the folder of temporary files cannot be written");
    QueueSettings queue = settings.remote;
    std::shared_ptr<TaskQueue> tasks = settings.queue;
    queue.attempts = settings.attempts;
    queue.drain = settings.drain;
    if (!tasks) {
        queue.folder = state->folder.path() + "/jobs";
        queue.program = settings.program;
        queue.device = settings.device;
        queue.threads = settings.threads;
        queue.max_memory = state->memory / 2;  // the rest is for previews and images
        queue.frames_per_task = 0;
        queue.max_jobs = 1;
        queue.frame_timeout_s = settings.frame_timeout_s;
        queue.slice_s = settings.slice_s;
        queue.poll = kLocalPoll;
        tasks = std::make_shared<LocalQueue>(
            LocalSettings{.memory = kOwnMemory + 2 * queue.max_memory});
    }
    state->runner = std::make_unique<JobRunner>(*state->store, state->readers, state->programs,
                                                state->counters, tasks, queue);
    for (const Status& status :
         {state->thumbnails.begin(), state->previews.begin(), state->runner->begin()})
        if (!status.ok()) return status;
    RETURN_IF_ERROR(state->watch.begin());
    return std::unique_ptr<Service>(new Service(std::move(state)));
} catch (...) {
    return status_of_exception("the service");
}

void Service::drain() {
    state_->draining = true;
    state_->runner->drain();
}

bool Service::alive() const {
    return state_->runner->state().lost == 0 && state_->thumbnails.alive() &&
           state_->previews.alive();
}

Answer<Job> Service::submit(const User& user, const std::string& body,
                            const std::string& idempotency_key, bool* created) {
    *created = false;
    return answer([&] {
        if (state_->draining)
            throw later(Problem::Kind::unavailable,
                        "the service is shutting down; try again later");
        if (idempotency_key.size() > kMaxKeyBytes)
            throw Problem{Problem::Kind::invalid,
                          concat("the Idempotency-Key is longer than ", kMaxKeyBytes, " bytes")};
        // Each user's keys are their own.
        const std::string key = idempotency_key.empty() || user.name.empty()
                                    ? idempotency_key
                                    : user.name + "\n" + idempotency_key;
        // An accepted body is not checked again.
        const auto earlier = stored(state_->store->job_of_key(key));
        const auto other_body = [](const Job& job) {
            return Problem{Problem::Kind::conflict, "job " + job.id +
                                                        " has this Idempotency-Key and another "
                                                        "body; use a new key"};
        };
        if (earlier && (earlier->body != body || earlier->owner != user.name))
            throw other_body(*earlier);
        if (earlier) return state_->shown(*earlier);
        const JobReader reader = state_->reader_of(user);
        Submission job = taken(check_submission(body, reader, state_->programs));
        check_priority(user, job.job.priority);
        for (const Job& other : stored(state_->store->writers(job.job.output)))
            if (auto refused = same_output(body, job, other, reader.roots()))
                throw std::move(*refused);
        job.job.key = key;
        const auto add = [&] {
            return stored(state_->store->add(job.job, state_->settings.max_queue, user));
        };
        Added added = add();
        if (added.result == Added::Result::over_limit && stored(settle(*state_->store, user)))
            added = add();
        switch (added.result) {
            case Added::Result::made:
                *created = true;
                added.job.message = joined(job.warnings, "; ");
                break;
            case Added::Result::same:
                break;
            case Added::Result::other_body:
                throw other_body(added.job);
            case Added::Result::over_limit:
            case Added::Result::full:
                throw later(Problem::Kind::busy, added.why);
        }
        // The reply says where it waits, so it starts afterward.
        Job shown = state_->shown(std::move(added.job));
        if (*created) state_->runner->wake();
        return shown;
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

Answer<std::vector<JobFrame>> Service::frames(const std::string& id, size_t from,
                                              size_t limit) const {
    return answer([&] {
        state_->check_known(id);
        auto frames = stored(state_->store->frames(id, from, limit));
        for (JobFrame& frame : frames) frame.output = state_->settings.roots.shown(frame.output);
        return frames;
    });
}

Answer<JobFrame> Service::frame(const std::string& id, int number) const {
    return answer([&] {
        JobFrame frame = state_->known(id, number);
        if (frame.state == FrameState::written || frame.state == FrameState::skipped) {
            // Everyone may look, but only at what the job's owner may read.
            const auto reader = state_->readers.of(state_->known(id).owner);
            if (reader.ok()) frame.sidecar = sidecar_of(frame.output, reader->roots());
        }
        frame.output = state_->settings.roots.shown(frame.output);
        return frame;
    });
}

Answer<Job> Service::cancel(const User& user, const std::string& id) {
    return answer([&] {
        const char* why_not = "; only waiting and running jobs can be canceled";
        return state_->change(user, id, why_not, [&](const Job&) {
            const bool done = stored(state_->store->cancel(id, kExitSignal + SIGTERM));
            if (done) state_->runner->wake();
            return done;
        });
    });
}

Answer<Job> Service::retry(const User& user, const std::string& id) {
    return answer([&] {
        const char* why_not = "; only failed and canceled jobs can be retried";
        Job shown = state_->change(user, id, why_not, [&](const Job& job) {
            const KnownUser owner = state_->settings.users->named(job.owner);
            const User& who = owner ? *owner : user;
            const auto again = [&] {
                return stored(state_->store->retry(id, who, state_->settings.max_queue));
            };
            Retried retried = again();
            if (!retried.why.empty() && stored(settle(*state_->store, who))) retried = again();
            if (!retried.why.empty()) throw later(Problem::Kind::busy, retried.why);
            return retried.done;
        });
        state_->runner->wake();
        return shown;
    });
}

Answer<Job> Service::change(const User& user, const std::string& id, const std::string& body) {
    return answer([&] {
        const int priority = taken(read_priority(body, state_->settings.roots));
        check_priority(user, priority);
        const char* why_not = "; only waiting and running jobs have a priority";
        Job shown = state_->change(user, id, why_not, [&](const Job&) {
            return stored(state_->store->set_priority(id, priority));
        });
        state_->runner->wake();
        return shown;
    });
}

Answer<Job> Service::forget(const User& user, const std::string& id) {
    return answer([&] {
        // An ended one may have processes that end their frame.
        const char* why_not = "; a job can be removed when it and its processes have ended";
        return state_->change(user, id, why_not,
                              [&](const Job&) { return stored(state_->store->forget(id)); });
    });
}

Answer<std::vector<Event>> Service::events(const std::string& id, int64_t after,
                                           size_t limit) const {
    return answer([&] {
        auto events = stored(state_->store->events(id, after, limit));
        if (events.empty() && !id.empty()) state_->check_known(id);
        return events;
    });
}

int64_t Service::newest_event() const {
    const auto newest = state_->store->newest_event();
    return newest.ok() ? *newest : 0;
}

Answer<ResultFile> Service::report_file(const User& user, const std::string& id,
                                        const std::string& name) const {
    return answer(
        [&] { return taken(report_file_of(state_->known(id), name, state_->reader_of(user))); });
}

Answer<ResultFile> Service::output(const User& user, const std::string& id, int frame) const {
    return answer([&] {
        return taken(output_of(state_->known(id, frame), state_->reader_of(user).roots()));
    });
}

void Service::on_event(std::function<void(const Event&)> listener) {
    const std::lock_guard lock(state_->listener_mutex);
    state_->listener = std::move(listener);
}

void Service::preview(const User& user, const std::string& body, const PictureWanted& wanted,
                      GivePicture done) {
    refuse(done, [&] {
        const JobReader reader = state_->reader_of(user);
        PictureWanted of_user = wanted;
        if (!wanted.session.empty()) of_user.session = user.name + "\n" + wanted.session;
        state_->previews.run(body, taken(reader.preview(body)), reader.roots(), of_user, done);
    });
}

void Service::frame_image(const User& user, const std::string& id, int frame, bool after,
                          const PictureWanted& wanted, GivePicture done) {
    refuse(done, [&] {
        state_->show(
            user, wanted, done,
            [job = state_->known(id), entry = state_->known(id, frame),
             after](const JobReader& reader) { return shown_frame(job, entry, after, reader); });
    });
}

void Service::job_image(const User& user, const std::string& id, const PictureWanted& wanted,
                        GivePicture done) {
    refuse(done, [&] {
        state_->show(user, wanted, done,
                     [job = state_->known(id), frames = stored(state_->store->frames(id))](
                         const JobReader& reader) { return shown_frame(job, frames, reader); });
    });
}

void Service::input_image(const User& user, const std::string& input, int frame,
                          const PictureWanted& wanted, GivePicture done) {
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
    return answer([&] {
        const JobReader reader = state_->reader_of(user);
        const JobRequest request = taken(reader.plan(body));
        return taken(state_->programs.plan(body, request, reader.roots()));
    });
}

Answer<Diagnostics> Service::check_chain(const std::string& body) const {
    return check_chain_text(body, state_->settings.roots, state_->registry);
}

std::string Service::passes() const {
    return passes_as_json(state_->registry);
}

std::string Service::chain_schema() const {
    return postchain::chain_schema(state_->registry);
}

io::Json Service::job_schema() const {
    return service::job_schema(state_->schemas);
}

Health Service::health() const {
    int64_t late_s = 0;
    const WatchedHealth watched = state_->watch.last(late_s);
    const RunnerState runner = state_->runner->state();
    Health health;
    const auto say = [&](const std::string& text) {
        if (!text.empty()) health.why += (health.why.empty() ? "" : "; ") + text;
    };
    const TaskQueue& queue = state_->runner->queue();
    health.renderer = queue.outlives() ? queue.name() : watched.renderer;
    health.draining = state_->draining;
    health.gl = watched.device.ok();
    health.confined = state_->settings.less_confined.empty();
    say(watched.device.message());
    say(runner.trouble);
    health.progress = late_s == 0 && alive() && runner.works && runner.trouble.empty();
    if (late_s > 0) say(concat("the service's disks have not answered for ", late_s, " s"));
    if (const size_t hanging = runner.lost + state_->hanging(); hanging > 0)
        say(concat(hanging == 1 ? "1 thread hangs" : concat(hanging, " threads hang"),
                   " in a disk"));
    say(watched.store.message());
    say(watched.disks);
    health.disk = watched.store.ok() && watched.disks.empty();
    health.queue = !health.draining && watched.queued < state_->settings.max_queue;
    if (health.draining)
        say("the service is shutting down");
    else if (!health.queue)
        say("the queue is full");
    say(state_->settings.less_confined);
    health.why = state_->settings.roots.shown_in(health.why);
    return health;
}

std::string Service::metrics() const {
    return state_->counters.text(state_->store->use(),
                                 state_->runner->state().lost + state_->hanging());
}

}  // namespace postchain::service
