#include "tools/service/work/job_log.h"

#include <cmath>

namespace postchain::service {
namespace {

double seconds_between(int64_t from_ms, int64_t to_ms) {
    return from_ms > 0 && to_ms > from_ms ? double(to_ms - from_ms) * 1e-3 : 0;
}

std::string text_of_seconds(double seconds) {
    return concat(std::round(seconds * 10) / 10, " s");
}

std::string value(const io::Json& data, const char* key) {
    const auto found = data.find(key);
    if (found == data.end()) return "";
    return found->is_string() ? found->get<std::string>() : io::json_text(*found);
}

}  // namespace

void log_event(const Event& event, const JobStore& store, Counters& counters,
               const std::function<void(const LogLine&)>& log) noexcept try {
    // Every frame is too much for a log; /metrics counts them.
    if (event.type == "frame" || event.type == "progress" || event.type == "frames") return;
    const auto found = store.job(event.job);
    if (!found.ok() || !*found) return;
    const Job& job = **found;
    const io::Json data = io::Json::parse(event.data, nullptr, false);
    const std::string message = data.is_object() ? value(data, "message") : "";
    LogLine line;
    line.fields = {{"event", event.type}, {"job", job.id}, {"kind", name_of(job.kind)}};
    if (!job.owner.empty()) line.fields["user"] = job.owner;
    const std::string who = job.owner.empty() ? "" : " of " + job.owner;
    const std::string what = concat("job ", job.id, who);
    const auto took = [&](double seconds) {
        line.fields["seconds"] = seconds;
        return text_of_seconds(seconds);
    };
    if (event.type == "started") {
        const bool first = job.started_ms + 1000 >= event.time_ms;
        const double waited = seconds_between(job.created_ms, event.time_ms);
        if (first) counters.started(waited);
        line.message = concat(what, " started: ", name_of(job.kind), ", priority ", job.priority,
                              ", ", took(waited), " after its submission");
    } else if (event.type == "done" || event.type == "failed" || event.type == "canceled") {
        counters.ended(job.kind, event.type);
        const double seconds = seconds_between(job.started_ms, event.time_ms);
        line.fields["frames"] = job.done;
        line.message = concat(what, " ", event.type, " ", took(seconds),
                              " after its start: ", job.done, " of ", job.frames, " frames");
        if (event.type == "failed") line.level = LogLine::Level::error;
        if (!message.empty()) line.message += "; " + message;
    } else if (event.type == "quarantined" || event.type == "frame_failed") {
        line.level = LogLine::Level::warning;
        line.fields["frame"] = data.is_object() ? data.value("frame", 0) : 0;
        line.message =
            concat(what, ": frame ", value(data, "frame"),
                   event.type == "quarantined" ? " quarantined" : " failed, attempt ",
                   event.type == "quarantined" ? "" : value(data, "attempts"), ": ", message);
    } else if (event.type == "queued") {
        line.message = concat(what, " queued: ", name_of(job.kind), ", priority ", job.priority);
    } else if (event.type == "requeued") {
        line.message = concat(what, " waits again: ", value(data, "why"));
    } else {
        line.message = concat(what, " ", event.type, ": ", io::json_text(data));
    }
    if (log) log(line);
} catch (...) {
    // A lost line must not cost a job.
}

}  // namespace postchain::service
