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
        {"id", about("string", "names the job"), [](const Job& j) { return Json(j.id); }},
        {"kind", about_words(kJobKinds, "what is done"),
         [](const Job& j) { return Json(name_of(j.kind)); }},
        {"state", about_words(kJobStates, "how far it is"),
         [](const Job& j) { return Json(name_of(j.state)); }},
        {"priority", about("integer", "-100 to 100, larger first"),
         [](const Job& j) { return Json(j.priority); }},
        {"message", about("string", "why it failed, or what is worth knowing"),
         [](const Job& j) { return Json(j.message); }},
        {"created", about_time("when it was submitted, UTC"),
         [](const Job& j) { return time_of(j.created_ms); }},
        {"started", about_time("when it was first begun"),
         [](const Job& j) { return time_of(j.started_ms); }},
        {"ended", about_time("when it was done, failed or was canceled"),
         [](const Job& j) { return time_of(j.ended_ms); }},
        {"frames", about("integer", "of the job, once known"),
         [](const Job& j) { return Json(j.frames); }},
        {"done", about("integer", "frames that are written, or were there already"),
         [](const Job& j) { return Json(j.done); }},
        {"failed", about("integer", "frames that are missing or set aside"),
         [](const Job& j) { return Json(j.failed); }},
        {"remaining_s", about("number", "estimate while it runs; 0 = unknown"),
         [](const Job& j) { return Json(j.remaining_s); }},
        {"exit_code", about("integer", "what the command would have ended with"),
         [](const Job& j) { return Json(j.exit_code); }},
        {"verdict", about("string", "of ab, bench and study, one line"),
         [](const Job& j) { return Json(j.verdict); }},
        {"request",
         {{"description", "the job as it was submitted"}},
         [](const Job& j) { return parsed(j.body); }},
    };
    return fields;
}

const std::vector<Field<JobFrame>>& frame_fields() {
    static const std::vector<Field<JobFrame>> fields = {
        {"frame", about("integer", "number of the frame"),
         [](const JobFrame& f) { return Json(f.frame); }},
        {"state", about_words(kFrameStates, "what came of it"),
         [](const JobFrame& f) { return Json(name_of(f.state)); }},
        {"attempts", about("integer", "how often it was begun"),
         [](const JobFrame& f) { return Json(f.attempts); }},
        {"output", about("string", "the file, as in the job"),
         [](const JobFrame& f) { return Json(f.output); }},
        {"message", about("string", "of the last failure"),
         [](const JobFrame& f) { return Json(f.message); }},
        {"filter_ms", about("number", "time to filter, milliseconds"),
         [](const JobFrame& f) { return Json(f.filter_ms); }},
    };
    return fields;
}

const std::vector<Field<JobFrame>>& frame_detail_fields() {
    static const std::vector<Field<JobFrame>> fields = [] {
        std::vector<Field<JobFrame>> all = frame_fields();
        all.push_back({"sidecar",
                       {{"type", {"object", "null"}},
                        {"description", "what ran, what was left out and why, times of each pass"}},
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
