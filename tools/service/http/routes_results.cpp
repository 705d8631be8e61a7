#include "tools/service/http/routes_results.h"

#include <limits>

#include "tools/measure/report/page/encode.h"
#include "tools/service/http/file_streams.h"
#include "tools/service/http/replies.h"
#include "tools/service/http/report_parts.h"

namespace postchain::service {
namespace {

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

Reply all_events(const Call& call) {
    Reply reply;
    reply.type = "text/event-stream";
    reply.events = events_wanted(call, "");
    return reply.events ? reply : problem(400, kNoEvent);
}

Reply frames(const Service& service, const Call& call) {
    return reply_to(service.frames(call.values[0]), [](const std::vector<JobFrame>& frames) {
        io::Json list = io::Json::array();
        for (const JobFrame& frame : frames) list.push_back(json_of(frame, frame_fields()));
        return json_reply(200, io::json_text({{"frames", list}}));
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

}  // namespace

void add_result_routes(std::vector<Route>& routes, Service& service) {
    // Reads from the service only.
    const auto read = [&](Reply (*reply)(const Service&, const Call&)) {
        return replies([&service, reply](const Call& call) { return reply(service, call); });
    };
    const QueryParameter after = {"after", "an event's id, instead of the header Last-Event-ID"};
    routes.push_back({.path = "/v1/jobs/{id}/frames",
                      .operation = "listFrames",
                      .summary = "Frames of a job",
                      .handle = read(frames),
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
                      .handle = replies(all_events),
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
             .other_types = {report::kPictureType},
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
         .other_types = {report::kPictureType},
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

}  // namespace postchain::service
