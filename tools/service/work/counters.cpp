#include "tools/service/work/counters.h"

#include <prometheus/counter.h>
#include <prometheus/gauge.h>
#include <prometheus/histogram.h>
#include <prometheus/registry.h>
#include <prometheus/text_serializer.h>
#include <unistd.h>

#include <algorithm>
#include <fstream>

namespace postchain::service {
namespace {

const prometheus::Histogram::BucketBoundaries kSeconds = {0.001, 0.003, 0.01, 0.03, 0.1, 0.3,
                                                          1,     3,     10,   30,   100, 300};

double resident_bytes() {
    std::ifstream status("/proc/self/statm");
    int64_t pages = 0, resident = 0;
    status >> pages >> resident;
    return double(resident) * double(sysconf(_SC_PAGESIZE));
}

}  // namespace

struct Counters::Families {
    prometheus::Registry registry;
    prometheus::Family<prometheus::Counter>& counters(const char* name, const char* help) {
        return prometheus::BuildCounter().Name(name).Help(help).Register(registry);
    }
    prometheus::Family<prometheus::Counter>& frames =
        counters("postchain_frames_total", "frames of jobs by result");
    prometheus::Family<prometheus::Counter>& ended =
        counters("postchain_jobs_ended_total", "jobs that ended, by state and kind");
    prometheus::Family<prometheus::Histogram>& steps =
        prometheus::BuildHistogram()
            .Name("postchain_step_seconds")
            .Help("time of each step of a frame: read, convert, filter, write")
            .Register(registry);
    const double start = double(now_ms()) * 1e-3;
};

// With 0, so that a rate counts the first one too.
Counters::Counters() : families_(std::make_unique<Families>()) {
    for (const char* outcome : {"written", "skipped", "held", "missing", "failed"})
        families_->frames.Add({{"result", outcome}});
    for (const auto kind : kJobKinds)
        for (const auto state : {JobState::done, JobState::failed, JobState::canceled})
            families_->ended.Add({{"kind", name_of(kind)}, {"state", name_of(state)}});
}

Counters::~Counters() = default;

void Counters::add(const io::Json& frame) noexcept try {
    families_->frames.Add({{"result", frame.at("outcome").get<std::string>()}}).Increment();
    for (const char* step : {"read", "convert", "filter", "write"})
        if (const double ms = frame.at("times_ms").value(step, 0.0); ms > 0)
            families_->steps.Add({{"step", step}}, kSeconds).Observe(ms * 1e-3);
} catch (...) {
    // A lost count must not cost a frame.
}

void Counters::ended(JobKind kind, const std::string& state) noexcept try {
    families_->ended.Add({{"kind", name_of(kind)}, {"state", state}}).Increment();
} catch (...) {
}

std::string Counters::text(const StoreUse& use, size_t stuck) const {
    prometheus::Registry now;
    const auto gauges = [&](const char* name, const char* help) -> auto& {
        return prometheus::BuildGauge().Name(name).Help(help).Register(now);
    };
    const auto gauge = [&](const char* name, const char* help, double value) {
        gauges(name, help).Add({}).Set(value);
    };
    // A clock that was set back makes no negative age.
    gauge("postchain_queue_oldest_seconds", "age of the oldest waiting job; 0 = none waits",
          use.oldest_queued_ms > 0
              ? double(std::max<int64_t>(now_ms() - use.oldest_queued_ms, 0)) * 1e-3
              : 0);
    gauge("postchain_stuck_threads", "threads that hang in a disk or a device", double(stuck));
    // Names of Prometheus's own client libraries.
    gauge("process_resident_memory_bytes", "resident memory of the process", resident_bytes());
    gauge("process_start_time_seconds", "start of the process since 1970", families_->start);
    auto& jobs = gauges("postchain_jobs", "jobs in the store by state");
    for (const JobState state : kJobStates) {
        const auto found = use.jobs.find(state);
        jobs.Add({{"state", name_of(state)}})
            .Set(found == use.jobs.end() ? 0 : double(found->second));
    }
    auto& bytes =
        gauges("postchain_user_bytes", "bytes that each user's jobs have written, as max_disk");
    for (const auto& [owner, written] : use.bytes)
        bytes.Add({{"user", owner}}).Set(double(written));
    auto families = families_->registry.Collect();
    for (auto& family : now.Collect()) families.push_back(std::move(family));
    return prometheus::TextSerializer().Serialize(families);
}

}  // namespace postchain::service
