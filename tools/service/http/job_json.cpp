#include "tools/service/http/job_json.h"

#include <cstdio>
#include <ctime>

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

// The value of a stored JSON text; null if it is not JSON.
Json parsed(const std::string& text) {
    Json json = Json::parse(text, nullptr, false);
    return json.is_discarded() ? Json() : json;
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

const std::vector<Field<Job>>& job_fields() {
    static const std::vector<Field<Job>> fields = {
        {"id", about("string", "id of the job"), [](const Job& j) { return Json(j.id); }},
        {"kind", about_words(kJobKinds, "kind of the job"),
         [](const Job& j) { return Json(name_of(j.kind)); }},
        {"state", about_words(kJobStates, "state of the job"),
         [](const Job& j) { return Json(name_of(j.state)); }},
        {"priority", about("integer", "-100 to 100; higher runs first"),
         [](const Job& j) { return Json(j.priority); }},
        {"message", about("string", "reason of a failure, or notes"),
         [](const Job& j) { return Json(j.message); }},
        {"created", about_time("time of submission, UTC"),
         [](const Job& j) { return time_of(j.created_ms); }},
        {"started", about_time("time of the first start"),
         [](const Job& j) { return time_of(j.started_ms); }},
        {"ended", about_time("time when it was done, failed or was canceled"),
         [](const Job& j) { return time_of(j.ended_ms); }},
        {"frames", about("integer", "number of frames; 0 until known"),
         [](const Job& j) { return Json(j.frames); }},
        {"done", about("integer", "frames that are written or were skipped"),
         [](const Job& j) { return Json(j.done); }},
        {"failed", about("integer", "frames that are missing or set aside"),
         [](const Job& j) { return Json(j.failed); }},
        {"remaining_s", about("number", "estimate while the job runs; 0 = unknown"),
         [](const Job& j) { return Json(j.remaining_s); }},
        {"exit_code", about("integer", "exit code of the command for the same work"),
         [](const Job& j) { return Json(j.exit_code); }},
        {"verdict", about("string", "result of ab, bench and study in one line"),
         [](const Job& j) { return Json(j.verdict); }},
        {"request",
         {{"description", "the submitted job"}},
         [](const Job& j) { return parsed(j.body); }},
    };
    return fields;
}

const std::vector<Field<JobFrame>>& frame_fields() {
    static const std::vector<Field<JobFrame>> fields = {
        {"frame", about("integer", "frame number"),
         [](const JobFrame& f) { return Json(f.frame); }},
        {"state", about_words(kFrameStates, "state of the frame"),
         [](const JobFrame& f) { return Json(name_of(f.state)); }},
        {"attempts", about("integer", "number of attempts"),
         [](const JobFrame& f) { return Json(f.attempts); }},
        {"output", about("string", "the output file, as in the job"),
         [](const JobFrame& f) { return Json(f.output); }},
        {"message", about("string", "the last failure"),
         [](const JobFrame& f) { return Json(f.message); }},
        {"filter_ms", about("number", "time to filter, milliseconds"),
         [](const JobFrame& f) { return Json(f.filter_ms); }},
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
