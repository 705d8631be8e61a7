#include "tools/service/work/service.h"

#include <atomic>

#include "config/chain_file.h"
#include "config/describe.h"
#include "config/schema.h"
#include "tools/service/store/job_store.h"
#include "tools/service/work/job_request.h"

namespace postchain::service {
namespace {

constexpr int kRetryAfterS = 30;
constexpr size_t kMaxKeyBytes = 255;

Problem problem(Problem::Kind kind, const std::string& detail, int retry_after_s = 0) {
    return {kind, detail, {}, retry_after_s};
}

// Of the store.
Problem problem_of(const Status& status) {
    return problem(Problem::Kind::unavailable, status.message(), kRetryAfterS);
}

Problem no_job(const std::string& id) {
    return problem(Problem::Kind::not_found, "no job '" + id.substr(0, 40) + "'");
}

}  // namespace

struct Service::State {
    State(const ServiceSettings& s, const PassRegistry& r)
        : settings(s), registry(r), reader(settings.roots, registry, settings.version) {}

    const ServiceSettings settings;
    const PassRegistry& registry;
    const JobReader reader;
    std::unique_ptr<JobStore> store;
    std::atomic<bool> draining = false;
};

Service::Service(std::unique_ptr<State> state) : state_(std::move(state)) {}

Service::~Service() = default;

Result<std::unique_ptr<Service>> Service::open(const ServiceSettings& settings,
                                               const PassRegistry& registry) {
    auto state = std::make_unique<State>(settings, registry);
    auto store = JobStore::open(settings.store, settings.attempts);
    if (!store.ok()) return store.status();
    state->store = std::move(*store);
    return std::unique_ptr<Service>(new Service(std::move(state)));
}

Answer<Job> Service::submit(const std::string& body, const std::string& idempotency_key,
                            bool* created) {
    *created = false;
    if (state_->draining)
        return problem(Problem::Kind::unavailable, "the service ends; ask the next one",
                       kRetryAfterS);
    if (idempotency_key.size() > kMaxKeyBytes)
        return problem(Problem::Kind::invalid,
                       concat("the Idempotency-Key is longer than ", kMaxKeyBytes, " bytes"));
    // What was taken once is not judged again.
    const auto earlier = state_->store->job_of_key(idempotency_key);
    if (!earlier.ok()) return problem_of(earlier.status());
    if (*earlier && (*earlier)->body == body) return **earlier;
    const auto request = state_->reader.job(body);
    if (const auto* refused = std::get_if<Problem>(&request)) return *refused;
    const JobRequest& job = std::get<JobRequest>(request);
    const auto added = state_->store->add(job.kind, body, job.priority, idempotency_key,
                                          state_->settings.max_queue);
    if (!added.ok()) return problem_of(added.status());
    switch (added->what) {
        case Added::What::made:
            *created = true;
            return added->job;
        case Added::What::same:
            return added->job;
        case Added::What::other_body:
            return problem(Problem::Kind::conflict, "this Idempotency-Key is that of job " +
                                                        added->job.id +
                                                        ", whose body is another; take a new key");
        case Added::What::full:
            break;
    }
    return problem(Problem::Kind::busy,
                   concat(state_->settings.max_queue, " jobs wait already; try again later"),
                   kRetryAfterS);
}

std::vector<Job> Service::jobs(const std::string& state, const std::string& before,
                               size_t limit) const {
    auto jobs = state_->store->jobs(state, before, limit);
    return jobs.ok() ? std::move(*jobs) : std::vector<Job>();
}

Answer<Job> Service::job(const std::string& id) const {
    const auto job = state_->store->job(id);
    if (!job.ok()) return problem_of(job.status());
    if (!*job) return no_job(id);
    return **job;
}

Answer<std::vector<JobFrame>> Service::frames(const std::string& id) const {
    const auto known = job(id);
    if (const auto* refused = std::get_if<Problem>(&known)) return *refused;
    auto frames = state_->store->frames(id);
    if (!frames.ok()) return problem_of(frames.status());
    for (JobFrame& frame : *frames) frame.output = state_->settings.roots.shown(frame.output);
    return std::move(*frames);
}

Answer<Job> Service::cancel(const std::string& id) {
    const auto done = state_->store->cancel(id);
    if (!done.ok()) return problem_of(done.status());
    const auto now = job(id);
    if (!*done && std::holds_alternative<Job>(now))
        return problem(Problem::Kind::conflict,
                       concat("job ", id, " is ", name_of(std::get<Job>(now).state), " already"));
    return now;
}

Answer<Job> Service::retry(const std::string& id) {
    const auto done = state_->store->retry(id);
    if (!done.ok()) return problem_of(done.status());
    const auto now = job(id);
    if (!*done && std::holds_alternative<Job>(now))
        return problem(Problem::Kind::conflict,
                       concat("job ", id, " is ", name_of(std::get<Job>(now).state),
                              "; only one that failed or was canceled is tried again"));
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

Diagnostics Service::check_chain(const std::string& text) const {
    return parse_chain(text, "chain", state_->registry).diagnostics;
}

std::string Service::passes() const {
    return passes_as_json(state_->registry);
}

std::string Service::chain_schema() const {
    return postchain::chain_schema(state_->registry);
}

std::string Service::job_schema() const {
    return job_schema_text(state_->reader);
}

}  // namespace postchain::service
