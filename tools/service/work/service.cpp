#include "tools/service/work/service.h"

#include <sys/statvfs.h>
#include <unistd.h>

#include <atomic>
#include <filesystem>
#include <fstream>
#include <future>
#include <iterator>

#include "config/chain_file.h"
#include "config/describe.h"
#include "config/reporter.h"
#include "config/schema.h"
#include "config/text_tree.h"
#include "tools/sequence/exr/planes_writer.h"
#include "tools/sequence/image/preview.h"
#include "tools/sequence/run/device.h"
#include "tools/sequence/run/plan_sequence.h"
#include "tools/service/store/job_store.h"
#include "tools/service/work/errands.h"
#include "tools/service/work/job_request.h"
#include "tools/service/work/json_body.h"
#include "tools/service/work/preview.h"
#include "tools/service/work/worker.h"

namespace postchain::service {
namespace {

constexpr int kRetryAfterS = 30;
constexpr size_t kMaxKeyBytes = 255;
constexpr uintmax_t kMaxReportBytes = 512 << 20;  // per file of a report
constexpr size_t kMaxImages = 64;                 // waiting previews and thumbnails
constexpr int kMaxPlannedFrames = 100;            // per request
constexpr uint64_t kMinRoom = 64 << 20;           // free bytes; below, a disk counts as full
constexpr auto kTestPatience = std::chrono::seconds(1);

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

// An error of a request's work.
Problem problem_of(const Status& status, const Roots& roots) {
    const std::string detail = roots.shown_in(status.message());
    switch (status.code()) {
        case StatusCode::gl:
            return problem(Problem::Kind::unavailable, detail, kRetryAfterS);
        case StatusCode::internal:
            return problem(Problem::Kind::internal, detail);
        default:
            return problem(Problem::Kind::invalid, detail);
    }
}

// Why files cannot be written to a folder; empty = they can.
std::string trouble_of_folder(const std::string& folder) {
    if (::access(folder.c_str(), W_OK | X_OK) != 0) return folder + ": cannot be written";
    struct statvfs room;
    if (::statvfs(folder.c_str(), &room) == 0 &&
        uint64_t(room.f_bavail) * uint64_t(room.f_frsize) < kMinRoom)
        return folder + ": the disk is full";
    return "";
}

std::string type_of(const std::string& name) {
    const std::string extension = std::filesystem::path(name).extension().string();
    if (extension == ".html") return "text/html; charset=utf-8";
    if (extension == ".json") return "application/json";
    if (extension == ".csv") return "text/csv; charset=utf-8";
    if (extension == ".md") return "text/markdown; charset=utf-8";
    if (extension == ".png") return "image/png";
    if (extension == ".exr") return "image/x-exr";
    if (extension == ".yaml") return "application/yaml";
    return "";
}

}  // namespace

struct Service::State {
    State(const ServiceSettings& s, const PassRegistry& r)
        : settings(s),
          registry(r),
          reader(settings.roots, registry, settings.version, settings.threads),
          counters(settings.version) {}

    const ServiceSettings settings;
    const PassRegistry& registry;
    const JobReader reader;
    Counters counters;
    std::unique_ptr<JobStore> store;
    std::unique_ptr<Worker> worker;
    // Destroyed before the worker, because it may wait for the worker's device.
    std::unique_ptr<ErrandThread> pictures;
    std::atomic<bool> draining = false;

    // A job of the store with the remaining time of the running job.
    Job shown(Job job) const {
        const auto [running, remaining_s] = worker->under_way();
        if (job.id == running) job.remaining_s = remaining_s;
        return job;
    }

    // Filters on the worker's thread and waits for it.
    Result<ImageF> filter(const PreparedPreview& preview) {
        auto promise = std::make_shared<std::promise<Result<ImageF>>>();
        auto result = promise->get_future();
        worker->run([promise, &preview](GlDevice* gl) {
            if (!gl)
                return promise->set_value(Status(StatusCode::gl, "no GL device is available now"));
            try {
                auto planes = gl->executor().filter(preview.plan, preview.planes);
                if (planes.ok())
                    promise->set_value(std::move(planes->at(Role::color)));
                else
                    promise->set_value(planes.status());
            } catch (...) {
                promise->set_value(status_of_exception("the preview"));
            }
        });
        return result.get();
    }

    // Queues the making of an image and passes its result to `done`.
    void picture(std::function<Result<Picture>()> work,
                 const std::function<void(Answer<Picture>)>& done) {
        const bool taken = pictures->run([this, work = std::move(work), done] {
            Result<Picture> picture = Status(StatusCode::internal, "no picture");
            try {
                picture = work();
            } catch (...) {
                picture = status_of_exception("the picture");
            }
            if (picture.ok())
                done(std::move(*picture));
            else
                done(problem_of(picture.status(), settings.roots));
        });
        if (!taken)
            done(problem(Problem::Kind::busy, "too many previews are waiting; try again", 1));
    }
};

Service::Service(std::unique_ptr<State> state) : state_(std::move(state)) {}

Service::~Service() {
    drain();
}

Result<std::unique_ptr<Service>> Service::open(const ServiceSettings& settings,
                                               const PassRegistry& registry) try {
    auto device = sequence::context_options_of(settings.device, settings.threads, settings.warn);
    if (!device.ok()) return device.status();
    auto state = std::make_unique<State>(settings, registry);
    auto store = JobStore::open(settings.store, settings.attempts);
    if (!store.ok()) return store.status();
    state->store = std::move(*store);
    if (settings.log) state->store->on_loss(settings.log);
    state->worker = std::make_unique<Worker>(*state->store, state->reader, state->counters,
                                             registry, *device, settings.attempts);
    state->pictures = std::make_unique<ErrandThread>(kMaxImages);
    if (Status status = state->pictures->begin(); !status.ok()) return status;
    if (Status status = state->worker->begin(); !status.ok()) return status;
    return std::unique_ptr<Service>(new Service(std::move(state)));
} catch (...) {
    return status_of_exception("the service");
}

void Service::drain() {
    state_->draining = true;
    state_->worker->drain();
}

Answer<Job> Service::submit(const std::string& body, const std::string& idempotency_key,
                            bool* created) {
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
    if (*earlier && (*earlier)->body == body) return **earlier;
    const auto request = state_->reader.job(body);
    if (const auto* refused = std::get_if<Problem>(&request)) return *refused;
    const JobRequest& job = std::get<JobRequest>(request);
    auto added = state_->store->add(job.kind, body, job.priority, idempotency_key,
                                    state_->settings.max_queue);
    if (!added.ok()) return problem_of(added.status());
    switch (added->what) {
        case Added::What::made:
            *created = true;
            state_->worker->wake();
            added->job.message = joined(job.warnings, "; ");
            return added->job;
        case Added::What::same:
            return added->job;
        case Added::What::other_body:
            return problem(Problem::Kind::conflict, "job " + added->job.id +
                                                        " has this Idempotency-Key and another "
                                                        "body; use a new key");
        case Added::What::full:
            break;
    }
    return problem(Problem::Kind::busy,
                   concat(state_->settings.max_queue, " jobs are waiting; try again later"),
                   kRetryAfterS);
}

Answer<std::vector<Job>> Service::jobs(const std::string& state, const std::string& before,
                                       size_t limit) const {
    auto jobs = state_->store->jobs(state, before, limit);
    if (!jobs.ok()) return problem_of(jobs.status());
    for (Job& job : *jobs) job = state_->shown(std::move(job));
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
    (*frame)->output = state_->settings.roots.shown((*frame)->output);
    return std::move(**frame);
}

Answer<Job> Service::cancel(const std::string& id) {
    const auto done = state_->store->cancel(id);
    if (!done.ok()) return problem_of(done.status());
    if (*done) state_->worker->stop_job(id);
    const auto now = job(id);
    if (!*done && std::holds_alternative<Job>(now))
        return problem(Problem::Kind::conflict,
                       concat("job ", id, " is already ", name_of(std::get<Job>(now).state)));
    return now;
}

Answer<Job> Service::retry(const std::string& id) {
    const auto done = state_->store->retry(id);
    if (!done.ok()) return problem_of(done.status());
    if (*done) state_->worker->wake();
    const auto now = job(id);
    if (!*done && std::holds_alternative<Job>(now))
        return problem(Problem::Kind::conflict,
                       concat("job ", id, " is ", name_of(std::get<Job>(now).state),
                              "; only failed and canceled jobs can be retried"));
    return now;
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
    state_->store->on_event(std::move(listener));
}

void Service::preview(const std::string& body, std::function<void(Answer<Picture>)> done,
                      const std::string& type) {
    auto read = state_->reader.preview(body);
    if (const auto* refused = std::get_if<Problem>(&read)) return done(*refused);
    // std::function must be copyable; a chain is not.
    const auto request = std::make_shared<JobRequest>(std::move(std::get<JobRequest>(read)));
    state_->picture(
        [state = state_.get(), request, type]() -> Result<Picture> {
            if (Status status = check_inputs(request->run.input, state->settings.roots);
                !status.ok())
                return status;
            auto prepared = prepare_preview(*request);
            if (!prepared.ok()) return prepared.status();
            auto color = state->filter(*prepared);
            if (!color.ok()) return color.status();
            const bool exr = type == "image/x-exr";
            auto bytes = exr ? io::planes_exr_bytes(*color, {"R", "G", "B", "A"})
                             : io::encode_png_preview(*color);
            if (!bytes.ok()) return bytes.status();
            return Picture{exr ? type : "image/png", std::move(*bytes)};
        },
        done);
}

void Service::thumbnail(const std::string& id, int frame, bool after,
                        std::function<void(Answer<Picture>)> done) {
    const auto known = job(id);
    if (const auto* refused = std::get_if<Problem>(&known)) return done(*refused);
    const auto entry = state_->store->frame(id, frame);
    if (!entry.ok()) return done(problem_of(entry.status()));
    if (!*entry)
        return done(problem(Problem::Kind::not_found, concat("job ", id, " has no frame ", frame)));
    auto read = state_->reader.job(std::get<Job>(known).body);
    if (const auto* refused = std::get_if<Problem>(&read)) return done(*refused);
    const auto request = std::make_shared<JobRequest>(std::move(std::get<JobRequest>(read)));
    const std::string path = after ? (*entry)->output : request->run.input.color().format(frame);
    std::error_code error;
    if (!std::filesystem::exists(path, error))
        return done(problem(Problem::Kind::not_found,
                            state_->settings.roots.shown(path) + ": does not exist"));
    if (!state_->settings.roots.resolve(path).ok())
        return done(problem(
            Problem::Kind::forbidden,
            state_->settings.roots.shown(path) + ": links outside the folders of this service"));
    state_->picture(
        [request, path, frame]() -> Result<Picture> {
            auto png = thumbnail_of(path, frame, request->run.source);
            if (!png.ok()) return png.status();
            return Picture{"image/png", std::move(*png)};
        },
        done);
}

Answer<Picture> Service::report_file(const std::string& id, const std::string& name) const {
    const auto known = job(id);
    if (const auto* refused = std::get_if<Problem>(&known)) return *refused;
    auto read = state_->reader.job(std::get<Job>(known).body);
    if (const auto* refused = std::get_if<Problem>(&read)) return *refused;
    const JobRequest& request = std::get<JobRequest>(read);
    if (request.kind == JobKind::run)
        return problem(Problem::Kind::not_found, "job " + id + " has no report");
    const std::string folder = request.kind == JobKind::ab      ? request.ab.folder
                               : request.kind == JobKind::bench ? request.bench.folder
                                                                : request.study_settings.folder;
    const auto path = state_->settings.roots.resolve(folder + "/" + name);
    std::error_code error;
    if (name.empty() || type_of(name).empty() || !path.ok() || !path->starts_with(folder + "/") ||
        !std::filesystem::is_regular_file(*path, error))
        return problem(Problem::Kind::not_found,
                       "the report of job " + id + " does not have this file");
    // Pages contain their images, so the limit is far above that of text files.
    if (std::filesystem::file_size(*path, error) > kMaxReportBytes || error)
        return problem(Problem::Kind::internal, "the file is too large to send");
    std::ifstream in(*path, std::ios::binary);
    Picture file{type_of(name), {std::istreambuf_iterator<char>(in), {}}};
    if (in.bad()) return problem(Problem::Kind::internal, "the file cannot be read");
    return file;
}

Answer<std::string> Service::plan(const std::string& body) {
    auto read = state_->reader.plan(body);
    if (const auto* refused = std::get_if<Problem>(&read)) return *refused;
    JobRequest& request = std::get<JobRequest>(read);
    const Roots& roots = state_->settings.roots;
    try {
        if (Status status = check_inputs(request.run.input, roots); !status.ok())
            return problem_of(status, roots);
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
        if (!status.ok()) return problem_of(status, roots);
        return io::json_text({{"frames", std::move(frames)}});
    } catch (...) {
        return problem_of(status_of_exception("the plan"), roots);
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
    const auto test = std::make_shared<std::promise<Status>>();
    auto tested = test->get_future();
    state_->worker->run([test](GlDevice* gl) {
        test->set_value(gl ? gl->test() : Status(StatusCode::gl, "no GL device is available now"));
    });
    // The current frame may take long; then the answer is the last known state.
    const bool answered = tested.wait_for(kTestPatience) == std::future_status::ready;
    const Worker::State worker = state_->worker->state();
    const Status status = answered ? tested.get() : Status();
    Health health;
    health.renderer = worker.renderer;
    health.draining = state_->draining;
    health.gl = worker.gl && status.ok();
    health.why = status.ok() ? worker.trouble : status.message();
    const auto say = [&](const std::string& text) {
        if (!text.empty()) health.why += (health.why.empty() ? "" : "; ") + text;
    };
    const Status in_place = state_->store->in_place();
    say(in_place.message());
    health.disk = in_place.ok();
    std::vector<std::string> folders = state_->settings.roots.folders();
    const auto beside = std::filesystem::path(state_->settings.store).parent_path();
    folders.push_back(beside.empty() ? "." : beside.string());
    for (const std::string& folder : folders) {
        const std::string trouble = trouble_of_folder(folder);
        say(trouble);
        health.disk = health.disk && trouble.empty();
    }
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
    return state_->counters.text(state_->store->counts());
}

}  // namespace postchain::service
