#include "tools/service/store/rows.h"

#include <charconv>

namespace postchain::service {
namespace {

template <class Enum, size_t n>
Enum named(const std::string& name, const std::array<Enum, n>& all, Enum otherwise) {
    for (const Enum one : all)
        if (name == name_of(one)) return one;
    return otherwise;
}

}  // namespace

int64_t number_of(const std::string& id) {
    int64_t number = 0;
    const char* end = id.data() + id.size();
    const auto parsed = std::from_chars(id.data(), end, number);
    const bool good = parsed.ec == std::errc() && parsed.ptr == end && number > 0;
    return good && std::to_string(number) == id ? number : 0;
}

JobState state_of(const std::string& name) {
    return named(name, kJobStates, JobState::failed);
}

Job job_of(const Statement& row) {
    Job job;
    job.id = row.text(0);
    job.kind = named(row.text(1), kJobKinds, JobKind::run);
    job.state = state_of(row.text(2));
    job.priority = int(row.integer(3));
    job.body = row.text(4);
    job.message = row.text(5);
    job.created_ms = row.integer(6);
    job.started_ms = row.integer(7);
    job.ended_ms = row.integer(8);
    job.frames = int(row.integer(9));
    job.done = int(row.integer(10));
    job.failed = int(row.integer(11));
    job.exit_code = int(row.integer(12));
    job.verdict = row.text(13);
    job.owner = row.text(14);
    job.bytes = row.integer(15);
    return job;
}

JobFrame frame_of(const Statement& row) {
    JobFrame frame;
    frame.frame = int(row.integer(0));
    frame.state = named(row.text(1), kFrameStates, FrameState::waiting);
    frame.attempts = int(row.integer(2));
    frame.output = row.text(3);
    frame.message = row.text(4);
    frame.filter_ms = row.number(5);
    return frame;
}

}  // namespace postchain::service
