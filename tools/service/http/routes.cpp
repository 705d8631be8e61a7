#include "tools/service/http/routes.h"

#include <optional>

#include "tools/page/encode.h"
#include "tools/page/page.h"
#include "tools/sequence/files/json.h"
#include "tools/service/http/job_json.h"
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
    return answer.ok() ? made(*answer) : problem(answer.status());
}

// Reads the queries `type` and `side` of a file's image.
PictureWanted picture_wanted(const Call& call) {
    PictureWanted wanted;
    if (call.query("type") == "values") wanted.type = page::kPictureType;
    wanted.side = call.number<int>("side");
    wanted.share = call.request.share;
    wanted.left = call.request.left;
    return wanted;
}

GivePicture image_to(const Respond& respond) {
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
Reply submit(Service& service, const Call& call) {
    const std::string* key = call.request.header("Idempotency-Key");
    if (key && key->empty()) return problem(400, "Idempotency-Key is empty");
    bool created = false;
    const auto answer = service.submit(call.user, call.request.body, key ? *key : "", &created);
    Reply reply = job_reply(created ? 202 : 200, answer);
    // Relative to /v1/jobs, which a proxy may have moved.
    if (answer.ok()) reply.headers.emplace_back("Location", "jobs/" + answer->id);
    return reply;
}

Reply list(Service& service, const Call& call) {
    const auto most = call.number<size_t>("limit");
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

// --------------------------------------------- results: frames, events, images, reports, outputs
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

Reply job_events(Service& service, const Call& call) {
    auto wanted = events_wanted(call, call.values[0]);
    if (!wanted) return problem(400, kNoEvent);
    return reply_to(service.job(call.values[0]), [&](const Job& job) {
        Reply reply;
        reply.type = "text/event-stream";
        // A finished job has no further events. 204 tells EventSource not to reconnect.
        const auto left = service.events(job.id, *wanted->after, 1);
        if (job.ended_ms != 0 && left.ok() && left->empty())
            reply.status = 204;
        else
            reply.events = std::move(wanted);
        return reply;
    });
}

Reply all_events(Service&, const Call& call) {
    Reply reply;
    reply.type = "text/event-stream";
    reply.events = events_wanted(call, "");
    return reply.events ? reply : problem(400, kNoEvent);
}

Reply frames(Service& service, const Call& call) {
    const auto most = call.number<size_t>("limit"), from = call.number<size_t>("from");
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

Reply frame(Service& service, const Call& call) {
    return reply_to(service.frame(call.values[0], call.frame()), [](const JobFrame& frame) {
        return json_reply(200, io::json_text(json_of(frame, frame_detail_fields())));
    });
}

Reply report(const Service& service, PageParts& parts, const Call& call) {
    const std::string picture = call.query("picture");
    const bool whole = picture.empty() && call.query("pictures").empty();
    Reply reply = reply_to(
        service.report_file(call.user, call.values[0], call.values[1]), [&](ResultFile file) {
            if (whole) return file_reply(file);
            if (!file.name.ends_with(".html")) return problem(404, "not a page");
            if (!picture.empty()) file.type = "text/plain; charset=utf-8";
            return reply_to(parts.find(file.path, picture),
                            [&](const auto& found) { return parts_reply(file, found); });
        });
    if (reply.status == 200) reply.headers.emplace_back(kPolicy, kReportPolicy);
    return reply;
}

Reply output(Service& service, const Call& call) {
    return reply_to(service.output(call.user, call.values[0], call.frame()), download_reply);
}

// ----------------------------------------- work without a job: plans, previews, checks of chains
constexpr size_t kLongestSession = 255;  // bytes, as /openapi.json says

Reply as_json(const std::string& text) {
    return json_reply(200, text);
}

Reply check_chain(Service& service, const Call& call) {
    return reply_to(service.check_chain(call.request.body), [](const Diagnostics& found) {
        return json_reply(200, io::json_text({{"diagnostics", json_of(found)}}));
    });
}

void preview(Service& service, const Call& call, const Respond& respond) {
    PictureWanted wanted = picture_wanted(call);
    // Another type only if Accept names it; a wildcard gets PNG.
    const std::string* accept = call.request.header("Accept");
    for (const char* type : {kExrType, page::kPictureType})
        if (accept && accept->find(type) != std::string::npos) wanted.type = type;
    if (const std::string* session = call.request.header("Preview-Session"))
        wanted.session = session->substr(0, kLongestSession);
    service.preview(call.user, call.request.body, wanted, image_to(respond));
}

// ---------------------------------- the service itself: page, user, schemas, health, counters
constexpr const char* kPagePolicy =
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' blob:; connect-src "
    "'self'; frame-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'";

constexpr auto kStalled = std::chrono::seconds(10);

Reply readiness(const Service& service, const RequestThreads& threads, const Call& call) {
    Health health = service.health();
    const auto say = [&](const auto&... words) {
        health.why += concat(health.why.empty() ? "" : "; ", words...);
    };
    if (const size_t hanging = threads.hanging(); hanging > 0)
        say(hanging, hanging == 1 ? " thread of requests hangs" : " threads of requests hang",
            " in a disk");
    const auto stalled = std::chrono::duration_cast<std::chrono::seconds>(threads.stalled());
    if (stalled >= kStalled)
        say("every thread of requests is busy, and the others have waited for ", stalled.count(),
            " s");
    health.progress &= threads.alive() && stalled < kStalled;
    const bool ready =
        health.gl && health.disk && health.queue && health.progress && !health.draining;
    Json body = {{"ready", ready},
                 {"gl", health.gl},
                 {"disk", health.disk},
                 {"queue", health.queue},
                 {"progress", health.progress},
                 {"draining", health.draining},
                 {"confined", health.confined}};
    // Details of the machine need the token.
    if (call.user.name != kStranger) {
        body["renderer"] = health.renderer;
        body["why"] = health.why;
    }
    Reply reply = json_reply(ready ? 200 : 503, io::json_text(body));
    if (!ready) reply.headers.emplace_back("Retry-After", "5");
    return reply;
}

Handler page_file(const char* file, const char* type) {
    return replies([file, type](const Call&) {
        Reply reply;
        reply.type = type;
        reply.body = page::file(file);
        reply.headers.emplace_back(kPolicy, kPagePolicy);
        return reply;
    });
}

}  // namespace

Api::Api(Service& service, const GuardSettings& guard, const std::string& version,
         const RequestThreads& threads)
    : guard_(guard) {
    const auto with = [&](Reply (*reply)(Service&, const Call&)) {
        return replies([&service, reply](const Call& call) { return reply(service, call); });
    };
    const auto change = [&](Answer<Job> (Service::*of)(const User&, const std::string&)) {
        return replies([&service, of](const Call& call) {
            return job_reply(200, (service.*of)(call.user, call.values[0]));
        });
    };
    const auto text = [](std::function<std::string()> get) {
        return replies([get = std::move(get)](const Call&) { return json_reply(200, get()); });
    };
    const auto frame_image = [&](bool filtered) {
        return [&service, filtered](const Call& call, const Respond& respond) {
            service.frame_image(call.user, call.values[0], call.frame(), filtered,
                                picture_wanted(call), image_to(respond));
        };
    };
    const auto parts = std::make_shared<PageParts>();
    routes_ = routes_of({
        {"submitJob", with(submit)},
        {"listJobs", with(list)},
        {"getJob", with([](Service& of, const Call& call) {
             return job_reply(200, of.job(call.values[0]));
         })},
        {"changeJob", with([](Service& of, const Call& call) {
             return job_reply(200, of.change(call.user, call.values[0], call.request.body));
         })},
        {"cancelJob", change(&Service::cancel)},
        {"retryJob", change(&Service::retry)},
        {"forgetJob", change(&Service::forget)},
        {"listFrames", with(frames)},
        {"getFrame", with(frame)},
        {"followJob", with(job_events)},
        {"followJobs", with(all_events)},
        {"getThumbnailBefore", frame_image(false)},
        {"getThumbnailAfter", frame_image(true)},
        {"getJobThumbnail",
         [&](const Call& call, const Respond& respond) {
             service.job_image(call.user, call.values[0], picture_wanted(call), image_to(respond));
         }},
        {"getOutput", with(output)},
        {"getReport",
         replies([&service, parts](const Call& call) { return report(service, *parts, call); })},
        {"browseFolder", with([](Service& of, const Call& call) {
             return reply_to(of.browse(call.user, call.query("folder")), as_json);
         })},
        {"listChains", with([](Service& of, const Call& call) {
             return reply_to(of.chains(call.user, call.query("file")), as_json);
         })},
        {"getInputFrame",
         [&](const Call& call, const Respond& respond) {
             service.input_image(call.user, call.query("input"), call.number<int>("frame"),
                                 picture_wanted(call), image_to(respond));
         }},
        {"planFrames", with([](Service& of, const Call& call) {
             return reply_to(of.plan(call.user, call.request.body), as_json);
         })},
        {"previewFrame",
         [&](const Call& call, const Respond& respond) { preview(service, call, respond); }},
        {"checkChain", with(check_chain)},
        {"getUser", replies([version](const Call& call) {
             return json_reply(200, io::json_text({{"user", call.user.name},
                                                   {"admin", call.user.admin},
                                                   {"version", version}}));
         })},
        {"listPasses", text([&] { return service.passes(); })},
        {"getChainSchema", text([&] { return service.chain_schema(); })},
        {"getJobSchema", text([&] { return io::json_text(service.job_schema(), 2); })},
        {"getOpenApi", text([&, version] {
             return openapi_of(routes_, service.job_schema(), version,
                               !guard_.users().are_everyone());
         })},
        {"getHealth", text([] { return "{\"status\": \"ok\"}"; })},
        {"getReadiness", replies([&service, threads](const Call& call) {
             return readiness(service, threads, call);
         })},
        {"getMetrics", replies([&service, threads](const Call&) {
             Reply reply;
             reply.type = "text/plain; version=0.0.4; charset=utf-8";
             reply.body = service.metrics() + threads.metrics();
             return reply;
         })},
        {"getPage", page_file("service/index.html", "text/html; charset=utf-8")},
        {"getPageStyle", page_file("service/style.css", "text/css; charset=utf-8")},
        {"getPageIcon", page_file("service/icon.svg", "image/svg+xml")},
        {"getPageScript", page_file("service/main.js", "text/javascript; charset=utf-8")},
    });
}

std::variant<Admitted, Reply> Api::admit(const Request& header) const {
    if (auto refused = guard_.refuse_shape(header)) return std::move(*refused);
    auto target = parse_target(header.target);
    if (!target) return problem(400, "the address is malformed");
    auto found = find_route(routes_, header.method, *target);
    const auto* match = std::get_if<Match>(&found);
    // A client without the token learns nothing about the routes.
    auto sender = guard_.identify(header);
    if (auto* refused = std::get_if<Reply>(&sender);
        refused && !(match && match->route->is("open")))
        return std::move(*refused);
    if (!match) return std::get<Reply>(std::move(found));
    const Route& route = *match->route;
    if (auto refused = refuse_queries(route, *target)) return std::move(*refused);
    const std::string* type = header.header("Content-Type");
    const std::string media = type ? type->substr(0, type->find(';')) : "";
    if (route.has_body() && !same_word(media.substr(0, media.find(' ')), "application/json"))
        return problem(415, "the body must be Content-Type: application/json");
    if (header.header("Content-Encoding")) return problem(415, "Content-Encoding is not allowed");
    if (!route.has_body()) {
        const std::string* length = header.header("Content-Length");
        if (header.header("Transfer-Encoding") || (length && *length != "0"))
            return problem(413, "this address does not take a body");
    }
    const auto* known = std::get_if<Sender>(&sender);
    return Admitted{std::move(*target), std::move(std::get<Match>(found)),
                    known ? *known : Sender()};
}

void Api::run(const Admitted& admitted, const Request& request, const Respond& respond) const {
    static const User stranger{.name = kStranger};
    const Match& match = admitted.match;
    match.route->handle({request, admitted.target, *match.route, match.values,
                         admitted.sender.user ? *admitted.sender.user : stranger},
                        respond);
}

}  // namespace postchain::service
