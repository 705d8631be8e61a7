#include "tools/service/http/api.h"

#include <charconv>

#include "tools/sequence/files/json.h"
#include "tools/service/http/job_json.h"
#include "tools/service/http/openapi.h"
#include "tools/service/http/problem.h"
#include "tools/service/page/page.h"

namespace postchain::service {
namespace {

using io::Json;

constexpr size_t kMaxJobs = 500;  // per reply
constexpr const char* kExr = "image/x-exr";
constexpr const char* kPolicy = "Content-Security-Policy";

Reply json_reply(int status, const std::string& text) {
    Reply reply;
    reply.status = status;
    reply.body = text + "\n";
    return reply;
}

Reply job_reply(int status, const Answer<Job>& answer) {
    if (const auto* wrong = std::get_if<Problem>(&answer)) return problem(*wrong);
    return json_reply(status, io::json_text(json_of(std::get<Job>(answer), job_fields())));
}

Reply image_reply(const Answer<Picture>& answer) {
    if (const auto* wrong = std::get_if<Problem>(&answer)) return problem(*wrong);
    Reply reply;
    reply.type = std::get<Picture>(answer).type;
    reply.body = std::get<Picture>(answer).bytes;
    return reply;
}

template <class T>
std::optional<T> number_of(const std::string& text) {
    T value = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
    return value;
}

std::string query_of(const Call& call, const std::string& name) {
    const auto found = call.target.query.find(name);
    return found == call.target.query.end() ? "" : found->second;
}

// From the header or, for clients that cannot set one, the query. Nothing if it is not an id.
std::optional<EventsWanted> events_wanted(const Call& call, const std::string& job) {
    EventsWanted wanted{job, std::nullopt};
    const std::string* header = call.request.header("Last-Event-ID");
    const std::string text = header ? *header : query_of(call, "after");
    if (text.empty()) {
        // All events of one job, or the future events of all jobs.
        if (!job.empty()) wanted.after = 0;
        return wanted;
    }
    wanted.after = number_of<int64_t>(text);
    if (!wanted.after || *wanted.after < 0) return std::nullopt;
    return wanted;
}

constexpr const char* kNoFrame = "the frame is not a number";
constexpr const char* kNoEvent = "Last-Event-ID (or ?after=) is not the number of an event";

}  // namespace

Api::Api(Service& service, const GuardSettings& guard, std::string version,
         std::function<std::string()> more_metrics)
    : service_(service),
      guard_(guard),
      version_(std::move(version)),
      more_metrics_(std::move(more_metrics)) {
    add_jobs();
    add_results();
    add_tools();
    add_about();
    add_page();
}

std::variant<Admitted, Reply> Api::admit(const Request& header) const {
    if (auto refused = guard_.refuse_shape(header)) return std::move(*refused);
    auto target = parse_target(header.target);
    if (!target) return problem(400, "the address is malformed");
    auto found = find_route(routes_, header.method, *target);
    // A client without the token learns nothing about the routes.
    const bool open = std::holds_alternative<Match>(found) && std::get<Match>(found).route->open;
    if (!open && !guard_.knows(header)) {
        Reply reply = problem(401, "this address requires a token: Authorization: Bearer TOKEN");
        reply.headers.emplace_back("WWW-Authenticate", "Bearer");
        return reply;
    }
    if (auto* refused = std::get_if<Reply>(&found)) return std::move(*refused);
    const Route& route = *std::get<Match>(found).route;
    const std::string* type = header.header("Content-Type");
    const std::string media = type ? type->substr(0, type->find(';')) : "";
    if (!route.body.empty() && !same_word(media.substr(0, media.find(' ')), "application/json"))
        return problem(415, "the body must be Content-Type: application/json");
    if (header.header("Content-Encoding")) return problem(415, "Content-Encoding is not allowed");
    if (route.body.empty()) {
        const std::string* length = header.header("Content-Length");
        if (header.header("Transfer-Encoding") || (length && *length != "0"))
            return problem(413, "this address does not take a body");
    }
    Admitted admitted{std::move(*target), std::move(std::get<Match>(found)), false};
    admitted.at_once = route.type == "text/html" || route.path == "/healthz";
    return admitted;
}

void Api::run(const Admitted& admitted, const Request& request, const Respond& respond) const {
    admitted.match.route->handle({request, admitted.target, admitted.match.values}, respond);
}

void Api::add_jobs() {
    routes_.push_back({.method = "POST",
                       .path = "/v1/jobs",
                       .summary = "Submits a job",
                       .handle =
                           [this](const Call& call, const Respond& respond) {
                               const std::string* key = call.request.header("Idempotency-Key");
                               if (key && key->empty())
                                   return respond(problem(400, "Idempotency-Key is empty"));
                               bool created = false;
                               const auto answer =
                                   service_.submit(call.request.body, key ? *key : "", &created);
                               Reply reply = job_reply(created ? 202 : 200, answer);
                               if (const Job* job = std::get_if<Job>(&answer))
                                   reply.headers.emplace_back("Location", "/v1/jobs/" + job->id);
                               respond(std::move(reply));
                           },
                       .body = "JobRequest",
                       .status = 202,
                       .schema = "Job"});
    routes_.push_back(
        {.method = "GET",
         .path = "/v1/jobs",
         .summary = "Jobs, newest first",
         .handle =
             [this](const Call& call, const Respond& respond) {
                 const std::string limit = query_of(call, "limit");
                 const auto most =
                     limit.empty() ? std::optional<size_t>(50) : number_of<size_t>(limit);
                 if (!most || *most < 1 || *most > kMaxJobs)
                     return respond(
                         problem(400, concat("limit is not an integer in 1..", kMaxJobs)));
                 auto answer =
                     service_.jobs(query_of(call, "state"), query_of(call, "before"), *most + 1);
                 if (const auto* wrong = std::get_if<Problem>(&answer))
                     return respond(problem(*wrong));
                 auto& jobs = std::get<std::vector<Job>>(answer);
                 const bool more = jobs.size() > *most;
                 if (more) jobs.pop_back();
                 Json list = Json::array();
                 for (const Job& job : jobs) list.push_back(json_of(job, job_fields()));
                 const Json next = more ? Json(jobs.back().id) : Json();
                 respond(json_reply(200, io::json_text({{"jobs", list}, {"next", next}})));
             },
         .queries = {{"state", "only jobs in this state"},
                     {"before", "a job's id: only older jobs"},
                     {"limit", "maximum number of jobs, 1 to 500; default 50"}},
         .schema = "Jobs"});
    routes_.push_back({.method = "GET",
                       .path = "/v1/jobs/{id}",
                       .summary = "A job",
                       .handle =
                           [this](const Call& call, const Respond& respond) {
                               respond(job_reply(200, service_.job(call.values[0])));
                           },
                       .schema = "Job"});
    routes_.push_back({.method = "DELETE",
                       .path = "/v1/jobs/{id}",
                       .summary = "Cancels a job",
                       .handle =
                           [this](const Call& call, const Respond& respond) {
                               respond(job_reply(200, service_.cancel(call.values[0])));
                           },
                       .schema = "Job"});
    routes_.push_back({.method = "POST",
                       .path = "/v1/jobs/{id}/retry",
                       .summary = "Runs the unfinished frames of a failed or canceled job",
                       .handle =
                           [this](const Call& call, const Respond& respond) {
                               respond(job_reply(200, service_.retry(call.values[0])));
                           },
                       .schema = "Job"});
}

void Api::add_results() {
    routes_.push_back({.method = "GET",
                       .path = "/v1/jobs/{id}/frames",
                       .summary = "Frames of a job",
                       .handle =
                           [this](const Call& call, const Respond& respond) {
                               const auto answer = service_.frames(call.values[0]);
                               if (const auto* wrong = std::get_if<Problem>(&answer))
                                   return respond(problem(*wrong));
                               Json list = Json::array();
                               for (const JobFrame& frame : std::get<std::vector<JobFrame>>(answer))
                                   list.push_back(json_of(frame, frame_fields()));
                               respond(json_reply(200, io::json_text({{"frames", list}})));
                           },
                       .schema = "Frames"});
    routes_.push_back({.method = "GET",
                       .path = "/v1/jobs/{id}/frames/{n}",
                       .summary = "A frame of a job, with its sidecar",
                       .handle =
                           [this](const Call& call, const Respond& respond) {
                               const auto number = number_of<int>(call.values[1]);
                               if (!number) return respond(problem(404, kNoFrame));
                               const auto answer = service_.frame(call.values[0], *number);
                               if (const auto* wrong = std::get_if<Problem>(&answer))
                                   return respond(problem(*wrong));
                               respond(
                                   json_reply(200, io::json_text(json_of(std::get<JobFrame>(answer),
                                                                         frame_detail_fields()))));
                           },
                       .schema = "FrameDetail"});
    routes_.push_back({.method = "GET",
                       .path = "/v1/jobs/{id}/events",
                       .summary = "Events of a job until it ends",
                       .handle =
                           [this](const Call& call, const Respond& respond) {
                               auto wanted = events_wanted(call, call.values[0]);
                               if (!wanted) return respond(problem(400, kNoEvent));
                               const auto job = service_.job(call.values[0]);
                               if (const auto* wrong = std::get_if<Problem>(&job))
                                   return respond(problem(*wrong));
                               Reply reply;
                               reply.type = "text/event-stream";
                               // A finished job has no further events. 204 tells EventSource not to
                               // reconnect.
                               const auto left = service_.events(call.values[0], *wanted->after, 1);
                               const Job& found = std::get<Job>(job);
                               if (found.ended_ms != 0 &&
                                   std::holds_alternative<std::vector<Event>>(left) &&
                                   std::get<std::vector<Event>>(left).empty())
                                   reply.status = 204;
                               else
                                   reply.events = std::move(wanted);
                               respond(std::move(reply));
                           },
                       .queries = {{"after", "an event's id, instead of the header Last-Event-ID"}},
                       .type = "text/event-stream"});
    routes_.push_back({.method = "GET",
                       .path = "/v1/events",
                       .summary = "Events of all jobs",
                       .handle =
                           [](const Call& call, const Respond& respond) {
                               Reply reply;
                               reply.type = "text/event-stream";
                               reply.events = events_wanted(call, "");
                               if (!reply.events) return respond(problem(400, kNoEvent));
                               respond(std::move(reply));
                           },
                       .queries = {{"after", "an event's id, instead of the header Last-Event-ID"}},
                       .type = "text/event-stream"});
    for (const bool after : {false, true})
        routes_.push_back(
            {.method = "GET",
             .path =
                 std::string("/v1/jobs/{id}/frames/{n}/") + (after ? "after.png" : "before.png"),
             .summary = after ? "Thumbnail of a filtered frame" : "Thumbnail of an input frame",
             .handle =
                 [this, after](const Call& call, const Respond& respond) {
                     const auto frame = number_of<int>(call.values[1]);
                     if (!frame) return respond(problem(404, kNoFrame));
                     service_.thumbnail(
                         call.values[0], *frame, after,
                         [respond](Answer<Picture> picture) { respond(image_reply(picture)); });
                 },
             .type = "image/png"});
    routes_.push_back(
        {.method = "GET",
         .path = "/v1/jobs/{id}/report/{name...}",
         .summary = "A file of the report of an ab, bench or study job",
         .handle =
             [this](const Call& call, const Respond& respond) {
                 Reply reply = image_reply(service_.report_file(call.values[0], call.values[1]));
                 // Pages contain scripts, so they run sandboxed in an origin of their own.
                 if (reply.status == 200)
                     reply.headers.emplace_back(
                         kPolicy,
                         "default-src 'none'; script-src 'unsafe-inline'; style-src "
                         "'unsafe-inline'; img-src 'self' data: blob:; sandbox allow-scripts "
                         "allow-downloads; base-uri 'none'; form-action 'none'; frame-ancestors "
                         "'self'");
                 respond(std::move(reply));
             },
         .type = "*/*"});
}

void Api::add_tools() {
    routes_.push_back({.method = "POST",
                       .path = "/v1/plan",
                       .summary = "Plans frames: steps, elided steps with reasons",
                       .handle =
                           [this](const Call& call, const Respond& respond) {
                               const auto answer = service_.plan(call.request.body);
                               if (const auto* wrong = std::get_if<Problem>(&answer))
                                   return respond(problem(*wrong));
                               respond(json_reply(200, std::get<std::string>(answer)));
                           },
                       .body = "PlanRequest"});
    routes_.push_back(
        {.method = "POST",
         .path = "/v1/preview",
         .summary = "Filters one frame",
         .handle =
             [this](const Call& call, const Respond& respond) {
                 // EXR only if Accept names it; a wildcard gets PNG.
                 const std::string* accept = call.request.header("Accept");
                 const bool exr = accept && accept->find(kExr) != std::string::npos;
                 service_.preview(
                     call.request.body,
                     [respond](Answer<Picture> picture) { respond(image_reply(picture)); },
                     exr ? kExr : "image/png");
             },
         .body = "PreviewRequest",
         .type = "image/png"});
    routes_.push_back({.method = "POST",
                       .path = "/v1/chain/check",
                       .summary = "Checks the text of a chain file",
                       .handle =
                           [this](const Call& call, const Respond& respond) {
                               const auto answer = service_.check_chain(call.request.body);
                               if (const auto* wrong = std::get_if<Problem>(&answer))
                                   return respond(problem(*wrong));
                               const auto& found = std::get<Diagnostics>(answer);
                               respond(
                                   json_reply(200, "{\"diagnostics\": " + json_of(found) + "}"));
                           },
                       .body = "ChainText",
                       .schema = "Diagnostics"});
}

void Api::add_about() {
    const auto text = [](std::string (Service::*get)() const, Service& service) {
        return [get, &service](const Call&, const Respond& respond) {
            respond(json_reply(200, (service.*get)()));
        };
    };
    routes_.push_back({.method = "GET",
                       .path = "/v1/passes",
                       .summary = "Passes and parameters",
                       .handle = text(&Service::passes, service_)});
    routes_.push_back({.method = "GET",
                       .path = "/v1/schema",
                       .summary = "JSON Schema of a chain file",
                       .handle = text(&Service::chain_schema, service_)});
    routes_.push_back({.method = "GET",
                       .path = "/v1/schema/job",
                       .summary = "JSON Schema of a job",
                       .handle = [this](const Call&, const Respond& respond) {
                           respond(json_reply(200, io::json_text(service_.job_schema(), 2)));
                       }});
    routes_.push_back({.method = "GET",
                       .path = "/openapi.json",
                       .summary = "This interface as OpenAPI",
                       .handle = [this](const Call&, const Respond& respond) {
                           respond(json_reply(200, openapi_of(routes_, service_.job_schema(),
                                                              version_, guard_.asks_for_token())));
                       }});
    routes_.push_back(
        {.method = "GET",
         .path = "/healthz",
         .summary = "200 while the process runs",
         .handle = [](const Call&,
                      const Respond& respond) { respond(json_reply(200, "{\"status\": \"ok\"}")); },
         .open = true});
    routes_.push_back({.method = "GET",
                       .path = "/readyz",
                       .summary = "200 if the service accepts jobs, otherwise 503",
                       .handle =
                           [this](const Call& call, const Respond& respond) {
                               const Health health = service_.health();
                               const bool ready =
                                   health.gl && health.disk && health.queue && !health.draining;
                               Json body = {{"ready", ready},
                                            {"gl", health.gl},
                                            {"disk", health.disk},
                                            {"queue", health.queue},
                                            {"draining", health.draining}};
                               // Details of the machine need the token.
                               if (guard_.knows(call.request)) {
                                   body["renderer"] = health.renderer;
                                   body["why"] = health.why;
                               }
                               Reply reply = json_reply(ready ? 200 : 503, io::json_text(body));
                               if (!ready) reply.headers.emplace_back("Retry-After", "5");
                               respond(std::move(reply));
                           },
                       .open = true});
    routes_.push_back({.method = "GET",
                       .path = "/metrics",
                       .summary = "Prometheus text format",
                       .handle =
                           [this](const Call&, const Respond& respond) {
                               Reply reply;
                               reply.type = "text/plain; version=0.0.4; charset=utf-8";
                               reply.body = service_.metrics();
                               if (more_metrics_) reply.body += more_metrics_();
                               respond(std::move(reply));
                           },
                       .type = "text/plain"});
}

void Api::add_page() {
    for (const PageFile& file : page_files())
        routes_.push_back({.method = "GET",
                           .path = file.address,
                           .summary = file.what,
                           .handle =
                               [file](const Call&, const Respond& respond) {
                                   Reply reply;
                                   reply.type = file.type;
                                   reply.body = std::string(file.text);
                                   reply.headers.emplace_back(
                                       kPolicy,
                                       "default-src 'none'; script-src 'self'; style-src 'self'; "
                                       "img-src 'self' blob:; connect-src 'self'; frame-src "
                                       "'self'; base-uri 'none'; form-action 'none'; "
                                       "frame-ancestors 'none'");
                                   respond(std::move(reply));
                               },
                           .open = true,
                           .type = "text/html"});
    routes_.push_back({.method = "GET",
                       .path = "/v1/session",
                       .summary = "Whether a token is required, and whether the request has it",
                       .handle =
                           [this](const Call& call, const Respond& respond) {
                               const Json body = {{"token", guard_.asks_for_token()},
                                                  {"known", guard_.knows(call.request)},
                                                  {"version", version_}};
                               respond(json_reply(200, io::json_text(body)));
                           },
                       .open = true});
    routes_.push_back({.method = "POST",
                       .path = "/v1/session",
                       .summary = "Sets a session cookie for a page that sends the token",
                       .handle =
                           [this](const Call&, const Respond& respond) {
                               Reply reply;
                               reply.status = 204;
                               if (guard_.asks_for_token())
                                   reply.headers.emplace_back("Set-Cookie",
                                                              guard_.session_cookie());
                               respond(std::move(reply));
                           },
                       .status = 204});
    routes_.push_back({.method = "DELETE",
                       .path = "/v1/session",
                       .summary = "Removes the session cookie",
                       .handle =
                           [](const Call&, const Respond& respond) {
                               Reply reply;
                               reply.status = 204;
                               reply.headers.emplace_back("Set-Cookie", Guard::no_session_cookie());
                               respond(std::move(reply));
                           },
                       .status = 204});
}

Headers security_headers(const Reply& reply) {
    Headers headers = {{"X-Content-Type-Options", "nosniff"},
                       {"Referrer-Policy", "no-referrer"},
                       {"Cross-Origin-Resource-Policy", "same-origin"},
                       {"Cache-Control", "no-store"}};
    bool has_policy = false;
    for (const auto& [name, value] : reply.headers) has_policy |= name == kPolicy;
    if (!has_policy) headers.emplace_back(kPolicy, "default-src 'none'; frame-ancestors 'none'");
    return headers;
}

}  // namespace postchain::service
