#include "tools/service/http/routes_jobs.h"

#include "tools/service/http/replies.h"

namespace postchain::service {
namespace {

constexpr size_t kJobs = 50, kMaxJobs = 500;  // per reply

Reply submit(Service& service, const Call& call) {
    const std::string* key = call.request.header("Idempotency-Key");
    if (key && key->empty()) return problem(400, "Idempotency-Key is empty");
    bool created = false;
    const auto answer = service.submit(call.user, call.request.body, key ? *key : "", &created);
    Reply reply = job_reply(created ? 202 : 200, answer);
    // Relative to /v1/jobs, which a proxy may have moved.
    if (const Job* job = std::get_if<Job>(&answer))
        reply.headers.emplace_back("Location", "jobs/" + job->id);
    return reply;
}

Reply list(const Service& service, const Call& call) {
    const std::string limit = call.query("limit");
    const auto most = limit.empty() ? std::optional(kJobs) : number_of<size_t>(limit);
    if (!most || *most < 1 || *most > kMaxJobs)
        return problem(400, concat("limit is not an integer in 1..", kMaxJobs));
    auto answer = service.jobs({call.query("state"), call.query("owner"), call.query("search"),
                                call.query("before"), *most + 1});
    return reply_to(answer, [most = *most](std::vector<Job> jobs) {
        const bool more = jobs.size() > most;
        if (more) jobs.pop_back();
        io::Json list = io::Json::array();
        for (const Job& job : jobs) list.push_back(json_of(job, job_fields()));
        const io::Json next = more ? io::Json(jobs.back().id) : io::Json();
        return json_reply(200, io::json_text({{"jobs", list}, {"next", next}}));
    });
}

std::vector<std::string> states() {
    std::vector<std::string> names;
    for (const JobState state : kJobStates) names.emplace_back(name_of(state));
    return names;
}

}  // namespace

void add_job_routes(std::vector<Route>& routes, Service& service) {
    const auto job = [&](Answer<Job> (Service::*change)(const User&, const std::string&)) {
        return replies([&service, change](const Call& call) {
            return job_reply(200, (service.*change)(call.user, call.values[0]));
        });
    };
    routes.push_back({.method = "POST",
                      .path = "/v1/jobs",
                      .operation = "submitJob",
                      .summary = "Submits a job",
                      .handle = replies([&](const Call& call) { return submit(service, call); }),
                      .body = "JobRequest",
                      .status = 202,
                      .refusals = {403, 409, 422},
                      .schema = "Job",
                      .reads_files = true});
    routes.push_back(
        {.method = "GET",
         .path = "/v1/jobs",
         .operation = "listJobs",
         .summary = "Jobs, newest first",
         .handle = replies([&](const Call& call) { return list(service, call); }),
         .queries = {{"state", "only jobs in this state", states()},
                     {"owner", "only jobs of this user"},
                     {"search",
                      "words that all occur in a job's id, kind, state, owner, message, input, "
                      "output, camera, chains or study; case does not matter"},
                     {"before", "a job's id: only older jobs", {}, "[1-9][0-9]{0,18}"},
                     {"limit", "maximum number of jobs, 1 to 500; default 50", {}, "[0-9]{1,9}"}},
         .schema = "Jobs"});
    routes.push_back({.method = "GET",
                      .path = "/v1/jobs/{id}",
                      .operation = "getJob",
                      .summary = "A job",
                      .handle = replies([&](const Call& call) {
                          return job_reply(200, service.job(call.values[0]));
                      }),
                      .schema = "Job"});
    routes.push_back({.method = "PATCH",
                      .path = "/v1/jobs/{id}",
                      .operation = "changeJob",
                      .summary = "Changes the priority of an unfinished job",
                      .handle = replies([&](const Call& call) {
                          return job_reply(
                              200, service.change(call.user, call.values[0], call.request.body));
                      }),
                      .body = "JobChange",
                      .refusals = {403, 409, 422},
                      .schema = "Job"});
    routes.push_back({.method = "DELETE",
                      .path = "/v1/jobs/{id}",
                      .operation = "cancelJob",
                      .summary = "Cancels a job",
                      .handle = job(&Service::cancel),
                      .refusals = {403, 409},
                      .schema = "Job"});
    routes.push_back({.method = "POST",
                      .path = "/v1/jobs/{id}/retry",
                      .operation = "retryJob",
                      .summary = "Runs the unfinished frames of a failed or canceled job",
                      .handle = job(&Service::retry),
                      .refusals = {403, 409},
                      .schema = "Job"});
    routes.push_back({.method = "DELETE",
                      .path = "/v1/jobs/{id}/record",
                      .operation = "forgetJob",
                      .summary = "Removes an ended job from the store; its outputs stay",
                      .handle = job(&Service::forget),
                      .refusals = {403, 409},
                      .schema = "Job"});
}

}  // namespace postchain::service
