#include "tools/service/http/event_log.h"

#include <algorithm>

#include "tools/service/http/job_json.h"

namespace postchain::service {
namespace {

bool ends_job(const Event& event) {
    return event.type == name_of(JobState::done) || event.type == name_of(JobState::failed) ||
           event.type == name_of(JobState::canceled);
}

}  // namespace

void EventLog::add(const std::vector<Event>& events) {
    for (const Event& event : events) {
        entries_.push_back({event.id, event.job, ends_job(event),
                            std::make_shared<const std::string>(text_of(event))});
        newest_ = event.id;
    }
    while (entries_.size() > keep_) {
        floor_ = entries_.front().id;
        entries_.pop_front();
    }
}

EventBatch EventLog::after(int64_t after, const std::string& job, size_t most) const {
    auto at = std::upper_bound(entries_.begin(), entries_.end(), after,
                               [](int64_t id, const Entry& entry) { return id < entry.id; });
    EventBatch batch;
    batch.last = after;
    for (; at != entries_.end() && batch.texts.size() < most; ++at) {
        batch.last = at->id;
        if (!job.empty() && at->job != job) continue;
        batch.texts.push_back(at->text);
        batch.ends = at->ends;
    }
    return batch;
}

EventBatch batch_of(const std::vector<Event>& events, int64_t asked) {
    EventBatch batch;
    batch.last = asked;
    for (const Event& event : events) {
        batch.texts.push_back(std::make_shared<const std::string>(text_of(event)));
        batch.last = event.id;
        batch.ends = ends_job(event);
    }
    return batch;
}

}  // namespace postchain::service
