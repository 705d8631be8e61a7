#include "tools/service/http/job_json.h"

#include <cstdio>
#include <ctime>

#include "tools/service/store/job.h"

namespace postchain::service {
namespace {

using io::Json;

Json about(const char* type, const char* description) {
    return {{"type", type}, {"description", description}};
}

Json about_time(const char* description) {
    return {{"type", {"string", "null"}}, {"format", "date-time"}, {"description", description}};
}

template <class E, size_t n>
Json about_words(const std::array<E, n>& words, const char* description) {
    Json names = Json::array();
    for (const E word : words) names.push_back(name_of(word));
    return {{"type", "string"}, {"enum", names}, {"description", description}};
}

template <class T, class Member>
Field<T> field(const char* name, Json schema, Member T::*member) {
    return {name, std::move(schema), [member](const T& item) {
                if constexpr (std::is_enum_v<Member>)
                    return Json(name_of(item.*member));
                else
                    return Json(item.*member);
            }};
}

Field<Job> time_field(const char* name, const char* description, int64_t Job::*member) {
    return {name, about_time(description),
            [member](const Job& job) { return time_of(job.*member); }};
}

// The value of a stored JSON text; null if it is not JSON.
Json parsed(const std::string& text) {
    auto json = io::read_json(text, "", io::kReportLimits);
    return json.ok() ? std::move(*json) : Json();
}

}  // namespace

Json time_of(int64_t ms) {
    if (ms == 0) return nullptr;
    const std::time_t seconds = std::time_t(ms / 1000);
    std::tm parts = {};
    gmtime_r(&seconds, &parts);
    char date[32], text[48];
    std::strftime(date, sizeof(date), "%Y-%m-%dT%H:%M:%S", &parts);
    std::snprintf(text, sizeof(text), "%s.%03dZ", date, int(ms % 1000));
    return text;
}

const std::vector<Field<Diagnostic>>& diagnostic_fields() {
    static const std::vector<Field<Diagnostic>> fields = {
        field("file", about("string", "name of the text"), &Diagnostic::file),
        field("line", about("integer", "from 1; 0 = the whole text"), &Diagnostic::line),
        field("column", about("integer", "from 1, in characters"), &Diagnostic::column),
        field("severity",
              about_words(std::array{Severity::note, Severity::warning, Severity::error},
                          "only errors refuse the text"),
              &Diagnostic::severity),
        field("path", about("string", "passes[1].samples"), &Diagnostic::path),
        field("message", about("string", "the fault and its remedy"), &Diagnostic::message),
    };
    return fields;
}

Json json_of(const Diagnostics& diagnostics) {
    Json array = Json::array();
    for (const Diagnostic& one : diagnostics) array.push_back(json_of(one, diagnostic_fields()));
    return array;
}

const std::vector<Field<Job>>& listed_job_fields() {
    static const std::vector<Field<Job>> fields = {
        field("id", about("string", "id of the job"), &Job::id),
        field("kind", about_words(kJobKinds, "kind of the job"), &Job::kind),
        field("state", about_words(kJobStates, "state of the job"), &Job::state),
        field("owner", about("string", "name of the user; empty without a file of users"),
              &Job::owner),
        field("priority", about("integer", "-100 to 100; higher runs first"), &Job::priority),
        field("message", about("string", "reason of a failure, or notes"), &Job::message),
        time_field("created", "time of submission, UTC", &Job::created_ms),
        time_field("started", "time of the first start", &Job::started_ms),
        time_field("ended", "time when it was done, failed or was canceled", &Job::ended_ms),
        field("frames", about("integer", "number of frames; 0 until known"), &Job::frames),
        field("done", about("integer", "frames that are written or were skipped"), &Job::done),
        field("failed", about("integer", "frames that are missing or quarantined"), &Job::failed),
        field("bytes", about("integer", "of the outputs that it wrote"), &Job::bytes),
        field("place", about("integer", "place in the queue, from 1; 0 = it does not wait"),
              &Job::place),
        field("remaining_s", about("number", "estimate while the job runs; 0 = unknown"),
              &Job::remaining_s),
        field("exit_code", about("integer", "exit code of the command for the same work"),
              &Job::exit_code),
        field("verdict", about("string", "result of ab, bench and study in one line"),
              &Job::verdict),
        {"about", about("object", "strings of the request: input, output, chain, chain_b, study"),
         [](const Job& j) { return parsed(j.about); }},
    };
    return fields;
}

const std::vector<Field<Job>>& job_fields() {
    static const std::vector<Field<Job>> fields = [] {
        std::vector<Field<Job>> all = listed_job_fields();
        all.push_back({"request", {{"description", "the submitted job"}}, [](const Job& j) {
                           return parsed(j.body);
                       }});
        return all;
    }();
    return fields;
}

const std::vector<Field<JobFrame>>& frame_fields() {
    static const std::vector<Field<JobFrame>> fields = {
        field("frame", about("integer", "frame number"), &JobFrame::frame),
        field("state", about_words(kFrameStates, "state of the frame"), &JobFrame::state),
        field("attempts", about("integer", "number of attempts"), &JobFrame::attempts),
        field("output", about("string", "the output file, as in the job"), &JobFrame::output),
        field("message", about("string", "the last failure, or warnings"), &JobFrame::message),
        field("filter_ms", about("number", "time to filter, milliseconds"), &JobFrame::filter_ms),
    };
    return fields;
}

const std::vector<Field<JobFrame>>& frame_detail_fields() {
    static const std::vector<Field<JobFrame>> fields = [] {
        std::vector<Field<JobFrame>> all = frame_fields();
        all.push_back(
            {"sidecar",
             {{"type", {"object", "null"}},
              {"description", "steps that ran, elided steps with reasons, times of each pass"}},
             [](const JobFrame& f) { return parsed(f.sidecar); }});
        return all;
    }();
    return fields;
}

std::string text_of(const Event& event) {
    const Json json = {{"type", event.type},
                       {"job", event.job},
                       {"time", time_of(event.time_ms)},
                       {"data", parsed(event.data)}};
    return "id: " + std::to_string(event.id) + "\ndata: " + io::json_text(json) + "\n\n";
}

}  // namespace postchain::service
