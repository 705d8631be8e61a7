#include "tools/service/http/routes.h"

#include <limits>
#include <optional>

#include "tools/page/encode.h"
#include "tools/page/page.h"
#include "tools/sequence/files/json.h"
#include "tools/service/http/file_streams.h"
#include "tools/service/http/job_json.h"
#include "tools/service/http/message.h"
#include "tools/service/http/openapi.h"
#include "tools/service/http/problem.h"
#include "tools/service/http/report_parts.h"

namespace postchain::service {
namespace {

using io::Json;

Reply json_reply(int status, const std::string& text) {
    Reply reply;
    reply.status = status;
    reply.body = text + "\n";
    return reply;
}

// The reply to an answer: its problem, or what `made` returns for its value.
template <class T, class Made>
Reply reply_to(const Answer<T>& answer, const Made& made) {
    if (const auto* wrong = std::get_if<Problem>(&answer)) return problem(*wrong);
    return made(std::get<T>(answer));
}

// Reads the queries `type` and `side` of an image.
ImageWanted image_wanted(const Call& call) {
    ImageWanted wanted;
    if (call.query("type") == "values") wanted.type = page::kPictureType;
    if (const auto side = number_of<int>(call.query("side"))) wanted.side = *side;
    wanted.share = call.request.share;
    wanted.left = call.request.left;
    return wanted;
}

std::vector<QueryParameter> image_queries() {
    return {{"type", "png: 8 bits; values: half floats for a page", {"png", "values"}},
            {.name = "side",
             .description = concat("largest width and height; default ", ImageWanted().side),
             .integer = {{1, kLargestImageSide}}}};
}

std::function<void(Answer<Picture>)> image_to(const Respond& respond) {
    return [respond](const Answer<Picture>& answer) {
        respond(reply_to(answer, [](const Picture& picture) {
            Reply reply;
            reply.type = picture.type;
            reply.body = picture.bytes;
            return reply;
        }));
    };
}

Reply job_reply(int status, const Answer<Job>& answer) {
    return reply_to(answer, [status](const Job& job) {
        return json_reply(status, io::json_text(json_of(job, job_fields())));
    });
}

// --------------------------------------------------------------- jobs: submission, list, changes
constexpr int kJobs = 50, kMaxJobs = 500;  // per reply

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
    const size_t most = number_of<size_t>(call.query("limit")).value_or(kJobs);
    auto answer = service.jobs({call.query("state"), call.query("owner"), call.query("search"),
                                call.query("before"), most + 1});
    return reply_to(answer, [most](std::vector<Job> jobs) {
        const bool more = jobs.size() > most;
        if (more) jobs.pop_back();
        Json list = Json::array();
        for (const Job& job : jobs) list.push_back(json_of(job, listed_job_fields()));
        const Json next = more ? Json(jobs.back().id) : Json();
        return json_reply(200, io::json_text({{"jobs", list}, {"next", next}}));
    });
}

std::vector<std::string> states() {
    std::vector<std::string> names;
    for (const JobState state : kJobStates) names.emplace_back(name_of(state));
    return names;
}

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
                      .audited = true,
                      .status = 202,
                      .refusals = {403, 409, 422},
                      .schema = "Job",
                      .reads_files = true});
    routes.push_back(
        {.path = "/v1/jobs",
         .operation = "listJobs",
         .summary = "Jobs, newest first",
         .handle = replies([&](const Call& call) { return list(service, call); }),
         .queries = {{"state", "only jobs in this state", states()},
                     {"owner", "only jobs of this user"},
                     {"search",
                      "words that all occur in a job's id, kind, state, owner, message, input, "
                      "output, camera, chains or study; case does not matter"},
                     {"before", "a job's id: only older jobs", {}, "[1-9][0-9]{0,18}"},
                     {.name = "limit",
                      .description = concat("maximum number of jobs; default ", kJobs),
                      .integer = {{1, kMaxJobs}}}},
         .schema = "Jobs"});
    routes.push_back({.path = "/v1/jobs/{id}",
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
                      .audited = true,
                      .refusals = {403, 409, 422},
                      .schema = "Job"});
    routes.push_back({.method = "DELETE",
                      .path = "/v1/jobs/{id}",
                      .operation = "cancelJob",
                      .summary = "Cancels a job",
                      .handle = job(&Service::cancel),
                      .audited = true,
                      .refusals = {403, 409},
                      .schema = "Job"});
    routes.push_back({.method = "POST",
                      .path = "/v1/jobs/{id}/retry",
                      .operation = "retryJob",
                      .summary = "Runs the unfinished frames of a failed or canceled job",
                      .handle = job(&Service::retry),
                      .audited = true,
                      .refusals = {403, 409},
                      .schema = "Job",
                      .reads_files = true});
    routes.push_back({.method = "DELETE",
                      .path = "/v1/jobs/{id}/record",
                      .operation = "forgetJob",
                      .summary = "Removes an ended job from the store; its outputs stay",
                      .handle = job(&Service::forget),
                      .audited = true,
                      .refusals = {403, 409},
                      .schema = "Job"});
}

// --------------------------------------------- results: frames, events, images, reports, outputs
constexpr int kFrames = 1000, kMaxFrames = 5000;  // per reply
constexpr const char* kNoFrame = "the frame is not a number";
constexpr const char* kNoEvent = "Last-Event-ID (or ?after=) is not the number of an event";

// Pages contain scripts, so they run sandboxed in an origin of their own.
constexpr const char* kReportPolicy =
    "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; img-src 'self' "
    "data: blob:; sandbox allow-scripts allow-downloads; base-uri 'none'; form-action 'none'; "
    "frame-ancestors 'self'";

// From the header or, for clients that cannot set one, the query. Nothing if it is not an id.
std::optional<EventsWanted> events_wanted(const Call& call, const std::string& job) {
    EventsWanted wanted{job, std::nullopt};
    const std::string* header = call.request.header("Last-Event-ID");
    const std::string text = header ? *header : call.query("after");
    if (text.empty()) {
        // All events of one job, or the future events of all jobs.
        if (!job.empty()) wanted.after = 0;
        return wanted;
    }
    wanted.after = number_of<int64_t>(text);
    if (!wanted.after || *wanted.after < 0) return std::nullopt;
    return wanted;
}

Reply job_events(const Service& service, const Call& call) {
    auto wanted = events_wanted(call, call.values[0]);
    if (!wanted) return problem(400, kNoEvent);
    return reply_to(service.job(call.values[0]), [&](const Job& job) {
        Reply reply;
        reply.type = "text/event-stream";
        // A finished job has no further events. 204 tells EventSource not to reconnect.
        const auto left = service.events(job.id, *wanted->after, 1);
        const auto* events = std::get_if<std::vector<Event>>(&left);
        if (job.ended_ms != 0 && events && events->empty())
            reply.status = 204;
        else
            reply.events = std::move(wanted);
        return reply;
    });
}

Reply all_events(const Service&, const Call& call) {
    Reply reply;
    reply.type = "text/event-stream";
    reply.events = events_wanted(call, "");
    return reply.events ? reply : problem(400, kNoEvent);
}

Reply frames(const Service& service, const Call& call) {
    const size_t most = number_of<size_t>(call.query("limit")).value_or(kFrames);
    const size_t from = number_of<size_t>(call.query("from")).value_or(0);
    return reply_to(service.frames(call.values[0], from, most + 1),
                    [most, from](std::vector<JobFrame> frames) {
                        const bool more = frames.size() > most;
                        if (more) frames.pop_back();
                        Json list = Json::array();
                        for (const JobFrame& frame : frames)
                            list.push_back(json_of(frame, frame_fields()));
                        const Json next = more ? Json(from + most) : Json();
                        return json_reply(200, io::json_text({{"frames", list}, {"next", next}}));
                    });
}

Reply frame(const Service& service, const Call& call) {
    const auto number = number_of<int>(call.values[1]);
    if (!number) return problem(404, kNoFrame);
    return reply_to(service.frame(call.values[0], *number), [](const JobFrame& frame) {
        return json_reply(200, io::json_text(json_of(frame, frame_detail_fields())));
    });
}

Reply report(const Service& service, PagePictures& pictures, const Call& call) {
    const std::string picture = call.query("picture");
    const bool apart = !call.query("pictures").empty();
    Reply reply = reply_to(
        service.report_file(call.user, call.values[0], call.values[1]),
        [&](const ResultFile& file) {
            if (picture.empty() && !apart) return file_reply(file);
            const auto text = !file.name.ends_with(".html")
                                  ? Result<std::string>(Status(StatusCode::input, "not a page"))
                              : apart ? page_without_pictures(file.path)
                                      : pictures.get(file.path, picture);
            if (!text.ok())
                return problem(404, "the report of job " + call.values[0] + " does not have this");
            Reply part;
            part.type = apart ? file.type : "text/plain; charset=utf-8";
            part.body = *text;
            return part;
        });
    if (reply.status == 200) reply.headers.emplace_back(kPolicy, kReportPolicy);
    return reply;
}

// "1-24", "7"; nothing if it is not a range.
std::optional<std::pair<int, int>> range_of(const std::string& text) {
    constexpr int kLast = std::numeric_limits<int>::max();
    if (text.empty()) return std::pair(-kLast, kLast);
    if (const auto one = number_of<int>(text)) return std::pair(*one, *one);
    const size_t dash = text.find('-', 1);
    if (dash == std::string::npos) return std::nullopt;
    const auto first = number_of<int>(text.substr(0, dash));
    const auto last = number_of<int>(text.substr(dash + 1));
    if (!first || !last || *first > *last) return std::nullopt;
    return std::pair(*first, *last);
}

Reply output(const Service& service, const Call& call) {
    const auto number = number_of<int>(call.values[1]);
    if (!number) return problem(404, kNoFrame);
    return reply_to(
        service.outputs(call.user, call.values[0], *number, *number),
        [](const std::vector<ResultFile>& files) { return download_reply(files.front()); });
}

Reply outputs(const Service& service, const Call& call) {
    const auto range = range_of(call.query("frames"));
    if (!range) return problem(400, "frames is not a range; expected 1-24 or 7");
    return reply_to(service.outputs(call.user, call.values[0], range->first, range->second),
                    [&](const std::vector<ResultFile>& files) {
                        return zip_reply(files, "job-" + call.values[0] + ".zip");
                    });
}

void add_result_routes(std::vector<Route>& routes, Service& service) {
    // Reads from the service only.
    const auto read = [&](Reply (*reply)(const Service&, const Call&)) {
        return replies([&service, reply](const Call& call) { return reply(service, call); });
    };
    const QueryParameter after = {"after", "an event's id, instead of the header Last-Event-ID"};
    routes.push_back(
        {.path = "/v1/jobs/{id}/frames",
         .operation = "listFrames",
         .summary = "Frames of a job, in its order",
         .handle = read(frames),
         .queries = {{.name = "from",
                      .description = "how many frames to leave out before; default 0",
                      .integer = {{0, 999'999'999}}},
                     {.name = "limit",
                      .description = concat("maximum number of frames; default ", kFrames),
                      .integer = {{1, kMaxFrames}}}},
         .schema = "Frames"});
    routes.push_back({.path = "/v1/jobs/{id}/frames/{n}",
                      .operation = "getFrame",
                      .summary = "A frame of a job, with its sidecar",
                      .handle = read(frame),
                      .schema = "FrameDetail",
                      .reads_files = true});
    routes.push_back({.path = "/v1/jobs/{id}/events",
                      .operation = "followJob",
                      .summary = "Events of a job until it ends; 204 after the last one",
                      .handle = read(job_events),
                      .queries = {after},
                      .type = "text/event-stream",
                      .streams = true});
    routes.push_back({.path = "/v1/events",
                      .operation = "followJobs",
                      .summary = "Events of all jobs",
                      .handle = read(all_events),
                      .queries = {after},
                      .type = "text/event-stream",
                      .streams = true});
    for (const bool filtered : {false, true})
        routes.push_back(
            {.path =
                 std::string("/v1/jobs/{id}/frames/{n}/") + (filtered ? "after.png" : "before.png"),
             .operation = filtered ? "getThumbnailAfter" : "getThumbnailBefore",
             .summary = filtered ? "A filtered frame, reduced" : "An input frame, reduced",
             .handle =
                 [&service, filtered](const Call& call, const Respond& respond) {
                     const auto number = number_of<int>(call.values[1]);
                     if (!number) return respond(problem(404, kNoFrame));
                     service.frame_image(call.user, call.values[0], *number, filtered,
                                         image_wanted(call), image_to(respond));
                 },
             .queries = image_queries(),
             .refusals = {403, 422},
             .type = "image/png",
             .other_types = {page::kPictureType},
             .reads_files = true});
    routes.push_back(
        {.path = "/v1/jobs/{id}/thumbnail.png",
         .operation = "getJobThumbnail",
         .summary = "The last finished frame of a job, otherwise its first input frame",
         .handle =
             [&service](const Call& call, const Respond& respond) {
                 service.job_image(call.user, call.values[0], image_wanted(call),
                                   image_to(respond));
             },
         .queries = image_queries(),
         .refusals = {403, 422},
         .type = "image/png",
         .other_types = {page::kPictureType},
         .reads_files = true});
    routes.push_back({.path = "/v1/jobs/{id}/frames/{n}/output",
                      .operation = "getOutput",
                      .summary = "The output of a finished frame",
                      .handle = read(output),
                      .refusals = {403},
                      .type = "image/*",
                      .reads_files = true});
    routes.push_back({.path = "/v1/jobs/{id}/outputs.zip",
                      .operation = "getOutputs",
                      .summary = "The outputs of finished frames in one archive",
                      .handle = read(outputs),
                      .queries = {{"frames", "a range, such as 1-24; default: all"}},
                      .refusals = {403},
                      .type = "application/zip",
                      .reads_files = true});
    routes.push_back(
        {.path = "/v1/jobs/{id}/report/{name...}",
         .operation = "getReport",
         .summary = "A file of the report of an ab, bench or study job",
         .handle = replies([&service, pictures = std::make_shared<PagePictures>()](
                               const Call& call) { return report(service, *pictures, call); }),
         .queries =
             {{"pictures", "apart: a page without its pictures", {"apart"}},
              {"picture", "the text of one picture of a page, by its id", {}, "image-[0-9]{1,9}"}},
         .refusals = {422},
         .type = "*/*",
         .reads_files = true});
}

// ----------------------------------------- work without a job: plans, previews, checks of chains
constexpr size_t kLongestSession = 255;  // bytes, as /openapi.json says

Reply as_json(const std::string& text) {
    return json_reply(200, text);
}

void preview(Service& service, const Call& call, const Respond& respond) {
    PreviewWanted wanted;
    // Another type only if Accept names it; a wildcard gets PNG.
    const std::string* accept = call.request.header("Accept");
    for (const char* type : {kExrType, page::kPictureType})
        if (accept && accept->find(type) != std::string::npos) wanted.type = type;
    if (const std::string* session = call.request.header("Preview-Session"))
        wanted.session = session->substr(0, kLongestSession);
    wanted.share = call.request.share;
    wanted.left = call.request.left;
    service.preview(call.user, call.request.body, wanted, image_to(respond));
}

void add_tool_routes(std::vector<Route>& routes, Service& service) {
    routes.push_back(
        {.path = "/v1/browse",
         .operation = "browseFolder",
         .summary = "Folders, sequences, cameras, chains and studies in a folder",
         .handle = replies([&](const Call& call) {
             return reply_to(service.browse(call.user, call.query("folder")), as_json);
         }),
         .queries = {{"folder", "a folder of the roots; default: the root, or a list of them"}},
         .refusals = {403, 404},
         .schema = "Folder",
         .reads_files = true});
    routes.push_back({.path = "/v1/chains",
                      .operation = "listChains",
                      .summary = "The shipped chains, or one chain file",
                      .handle = replies([&](const Call& call) {
                          return reply_to(service.chains(call.user, call.query("file")), as_json);
                      }),
                      .queries = {{"file", "a chain file of the roots"}},
                      .refusals = {403, 404, 422},
                      .schema = "Chains",
                      .reads_files = true});
    routes.push_back({.path = "/v1/image",
                      .operation = "getInputFrame",
                      .summary = "A frame of an input, reduced",
                      .handle =
                          [&](const Call& call, const Respond& respond) {
                              service.input_image(call.user, call.query("input"),
                                                  *number_of<int>(call.query("frame")),
                                                  image_wanted(call), image_to(respond));
                          },
                      .queries =
                          [] {
                              auto queries = image_queries();
                              queries.push_back({.name = "input",
                                                 .description = "frames, as in a job",
                                                 .required = true});
                              queries.push_back({.name = "frame",
                                                 .description = "a frame number",
                                                 .pattern = "-?[0-9]{1,9}",
                                                 .required = true});
                              return queries;
                          }(),
                      .refusals = {403, 404, 422},
                      .type = "image/png",
                      .other_types = {page::kPictureType},
                      .reads_files = true});
    routes.push_back({.method = "POST",
                      .path = "/v1/plan",
                      .operation = "planFrames",
                      .summary = "Plans frames: steps, elided steps with reasons",
                      .handle = replies([&](const Call& call) {
                          return reply_to(service.plan(call.user, call.request.body), as_json);
                      }),
                      .body = "PlanRequest",
                      .refusals = {403, 422},
                      .reads_files = true});
    routes.push_back({.method = "POST",
                      .path = "/v1/preview",
                      .operation = "previewFrame",
                      .summary = "Filters one frame. A later preview with the same header "
                                 "Preview-Session ends an earlier one",
                      .handle = [&](const Call& call,
                                    const Respond& respond) { preview(service, call, respond); },
                      .body = "PreviewRequest",
                      .refusals = {403, 409, 422},
                      .type = "image/png",
                      .other_types = {kExrType, page::kPictureType},
                      .reads_files = true});
    routes.push_back(
        {.method = "POST",
         .path = "/v1/chain/check",
         .operation = "checkChain",
         .summary = "Checks the text of a chain file",
         .handle = replies([&](const Call& call) {
             return reply_to(service.check_chain(call.request.body), [](const CheckedChain& found) {
                 return json_reply(200, "{\"diagnostics\": " + json_of(found.diagnostics) +
                                            ", \"chain\": " + io::json_text(found.values) + "}");
             });
         }),
         .body = "ChainText",
         .refusals = {422},
         .schema = "CheckedChain"});
}

// ---------------------------------- the service itself: page, session, schemas, health, counters
constexpr const char* kPagePolicy =
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' blob:; connect-src "
    "'self'; frame-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'";

constexpr auto kStalled = std::chrono::seconds(10);

Reply readiness(const Service& service, const RequestThreads& threads, const Call& call) {
    Health health = service.health();
    if (const size_t hanging = threads.hanging(); hanging > 0)
        health.why += concat(
            health.why.empty() ? "" : "; ", hanging,
            hanging == 1 ? " thread of requests hangs" : " threads of requests hang", " in a disk");
    const auto stalled = std::chrono::duration_cast<std::chrono::seconds>(threads.stalled());
    if (stalled >= kStalled)
        health.why += concat(health.why.empty() ? "" : "; ",
                             "every thread of requests is busy, and the others have waited for ",
                             stalled.count(), " s");
    health.progress &= threads.alive() && stalled < kStalled;
    const bool ready =
        health.gl && health.disk && health.queue && health.progress && !health.draining;
    Json body = {{"ready", ready},
                 {"gl", health.gl},
                 {"disk", health.disk},
                 {"queue", health.queue},
                 {"progress", health.progress},
                 {"draining", health.draining}};
    // Details of the machine need the token.
    if (call.user.name != kStranger) {
        body["renderer"] = health.renderer;
        body["why"] = health.why;
    }
    Reply reply = json_reply(ready ? 200 : 503, io::json_text(body));
    if (!ready) reply.headers.emplace_back("Retry-After", "5");
    return reply;
}

void add_session(std::vector<Route>& routes, const Guard& guard, const std::string& version) {
    routes.push_back({.path = "/v1/session",
                      .operation = "getSession",
                      .summary = "Whether a token is required, and whose the request has",
                      .handle = replies([&guard, version](const Call& call) {
                          const bool known = call.user.name != kStranger;
                          const Json body = {{"token", guard.asks_for_token()},
                                             {"known", known},
                                             {"user", known ? call.user.name : ""},
                                             {"admin", known && call.user.admin},
                                             {"version", version}};
                          return json_reply(200, io::json_text(body));
                      }),
                      .open = true,
                      .at_once = true});
    const auto cookie = [&guard](bool begins) {
        return replies([&guard, begins](const Call& call) {
            Reply reply;
            reply.status = 204;
            const std::string value = begins ? guard.begin_session(call.request) : "";
            if (!begins) guard.end_session(call.request);
            if (!begins || !value.empty())
                reply.headers.emplace_back("Set-Cookie", guard.cookie(call.request, value));
            return reply;
        });
    };
    routes.push_back({.method = "POST",
                      .path = "/v1/session",
                      .operation = "beginSession",
                      .summary = "Sets a session cookie for a page that sends the token",
                      .handle = cookie(true),
                      .audited = true,
                      .status = 204});
    routes.push_back({.method = "DELETE",
                      .path = "/v1/session",
                      .operation = "endSession",
                      .summary = "Ends the session, and removes its cookie",
                      .handle = cookie(false),
                      .audited = true,
                      .status = 204});
}

// The last of all: /openapi.json describes the routes before it.
void add_about_routes(std::vector<Route>& routes, Service& service, const Guard& guard,
                      const std::string& version, const RequestThreads& threads) {
    const auto text = [&](const char* path, const char* operation, const char* summary,
                          std::function<std::string()> get) {
        routes.push_back({.path = path,
                          .operation = operation,
                          .summary = summary,
                          .handle = replies([get = std::move(get)](const Call&) {
                              return json_reply(200, get());
                          })});
    };
    text("/v1/passes", "listPasses", "Passes and parameters", [&] { return service.passes(); });
    text("/v1/schema", "getChainSchema", "JSON Schema of a chain file",
         [&] { return service.chain_schema(); });
    text("/v1/schema/job", "getJobSchema", "JSON Schema of a job",
         [&] { return io::json_text(service.job_schema(), 2); });
    text("/openapi.json", "getOpenApi", "This interface as OpenAPI", [&, version] {
        return openapi_of(routes, service.job_schema(), version, guard.asks_for_token());
    });
    routes.push_back(
        {.path = "/healthz",
         .operation = "getHealth",
         .summary = "200 while the process runs",
         .handle = replies([](const Call&) { return json_reply(200, "{\"status\": \"ok\"}"); }),
         .open = true,
         .at_once = true});
    routes.push_back(
        {.path = "/readyz",
         .operation = "getReadiness",
         .summary = "200 if the service accepts jobs and they make progress, otherwise 503",
         .handle = replies(
             [&service, threads](const Call& call) { return readiness(service, threads, call); }),
         .open = true,
         .at_once = true});
    routes.push_back({.path = "/metrics",
                      .operation = "getMetrics",
                      .summary = "Prometheus text format",
                      .handle = replies([&service, threads](const Call&) {
                          Reply reply;
                          reply.type = "text/plain; version=0.0.4; charset=utf-8";
                          reply.body = service.metrics() + threads.metrics();
                          return reply;
                      }),
                      .type = "text/plain"});
    const auto page_file = [&](const char* path, const std::string& type, const char* operation,
                               const char* summary, const char* file) {
        routes.push_back({.path = path,
                          .operation = operation,
                          .summary = summary,
                          .handle = replies([type, file](const Call&) {
                              Reply reply;
                              reply.type = type;
                              reply.body = page::file(file);
                              reply.headers.emplace_back(kPolicy, kPagePolicy);
                              return reply;
                          }),
                          .open = true,
                          .type = type.substr(0, type.find(';')),
                          .at_once = true});
    };
    page_file("/", "text/html; charset=utf-8", "getPage", "The page", "service/index.html");
    page_file("/page/style.css", "text/css; charset=utf-8", "getPageStyle", "Its style",
              "service/style.css");
    page_file("/page/icon.svg", "image/svg+xml", "getPageIcon", "Its icon", "service/icon.svg");
    page_file("/page/main.js", "text/javascript; charset=utf-8", "getPageScript", "Its script",
              "service/main.js");
    add_session(routes, guard, version);
}

}  // namespace

Api::Api(Service& service, const GuardSettings& guard, const std::string& version,
         const RequestThreads& threads)
    : guard_(guard) {
    add_job_routes(routes_, service);
    add_result_routes(routes_, service);
    add_tool_routes(routes_, service);
    add_about_routes(routes_, service, guard_, version, threads);
}

std::variant<Admitted, Reply> Api::admit(const Request& header) const {
    if (auto refused = guard_.refuse_shape(header)) return std::move(*refused);
    // Addresses in the page are relative to a folder.
    if (guard_.is_base(header.target)) {
        Reply reply;
        reply.status = 308;
        reply.type = "text/plain";
        reply.headers.emplace_back("Location", header.target + "/");
        return reply;
    }
    auto target = parse_target(guard_.without_base(header.target));
    if (!target) return problem(400, "the address is malformed");
    auto found = find_route(routes_, header.method, *target);
    // A client without the token learns nothing about the routes.
    const bool open = is_open(routes_, header.method, *target);
    auto user = guard_.identify(header);
    if (auto* refused = std::get_if<Reply>(&user); refused && !open) return std::move(*refused);
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
    KnownUser known = std::holds_alternative<KnownUser>(user) ? std::get<KnownUser>(user) : nullptr;
    return Admitted{std::move(*target), std::move(std::get<Match>(found)), std::move(known)};
}

void Api::run(const Admitted& admitted, const Request& request, const Respond& respond) const {
    static const User stranger{.name = kStranger};
    const Match& match = admitted.match;
    match.route->handle(
        {request, admitted.target, match.values, admitted.user ? *admitted.user : stranger},
        respond);
}

}  // namespace postchain::service
