#include "tools/service/work/counters.h"

#include <prometheus/counter.h>
#include <prometheus/gauge.h>
#include <prometheus/histogram.h>
#include <prometheus/registry.h>
#include <prometheus/text_serializer.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <set>

namespace postchain::service {
namespace {

const prometheus::Histogram::BucketBoundaries& seconds() {
    static const prometheus::Histogram::BucketBoundaries bounds = {
        0.001, 0.003, 0.01, 0.03, 0.1, 0.3, 1, 3, 10, 30, 100, 300};
    return bounds;
}

size_t entries_of(const char* folder) {
    std::error_code error;
    size_t count = 0;
    for (std::filesystem::directory_iterator at(folder, error), end; !error && at != end;
         at.increment(error))
        ++count;
    return count;
}

}  // namespace

struct Counters::Families {
    explicit Families(const std::string& v) : version(v) {}

    const std::string version;
    prometheus::Registry registry;
    prometheus::Family<prometheus::Counter>& counters(const char* name, const char* help) {
        return prometheus::BuildCounter().Name(name).Help(help).Register(registry);
    }
    prometheus::Counter& counter(const char* name, const char* help) {
        return counters(name, help).Add({});
    }
    prometheus::Family<prometheus::Gauge>& gauges(const char* name, const char* help) {
        return prometheus::BuildGauge().Name(name).Help(help).Register(registry);
    }
    prometheus::Gauge& gauge(const char* name, const char* help) {
        return gauges(name, help).Add({});
    }
    prometheus::Family<prometheus::Histogram>& histograms(const char* name, const char* help) {
        return prometheus::BuildHistogram().Name(name).Help(help).Register(registry);
    }

    prometheus::Family<prometheus::Counter>& frames =
        counters("postchain_frames_total", "frames of jobs by result");
    prometheus::Family<prometheus::Histogram>& steps = histograms(
        "postchain_step_seconds", "time of each step of a frame: read, convert, filter, write");
    prometheus::Family<prometheus::Counter>& left_out =
        counters("postchain_passes_left_out_total", "elided passes by pass and rule");
    prometheus::Family<prometheus::Counter>& nonfinite =
        counters("postchain_nonfinite_pixels_total", "pixels with NaN or Inf in input and output");
    prometheus::Family<prometheus::Gauge>& jobs =
        gauges("postchain_jobs", "jobs in the store by state");
    prometheus::Gauge& textures =
        gauge("postchain_texture_bytes_peak", "peak bytes of allocated textures");
    prometheus::Gauge& alive =
        gauge("postchain_textures", "textures allocated after the last frame");
    prometheus::Family<prometheus::Gauge>& build =
        gauges("postchain_build_info", "1, with version and GL renderer");
    prometheus::Histogram& queue_wait =
        histograms("postchain_queue_wait_seconds",
                   "time from the submission of a job to its first start")
            .Add({},
                 prometheus::Histogram::BucketBoundaries{0.1, 1, 10, 60, 300, 1800, 7200, 43200});
    prometheus::Family<prometheus::Counter>& ended =
        counters("postchain_jobs_ended_total", "jobs that ended, by state and kind");
    prometheus::Counter& waits = counter("postchain_preview_wait_seconds_total",
                                         "time that jobs have left the device to previews");
    // Gauges that are set when they are read.
    prometheus::Gauge& oldest =
        gauge("postchain_queue_oldest_seconds", "age of the oldest waiting job; 0 = none waits");
    prometheus::Gauge& store = gauge("postchain_store_bytes", "size of the store with its log");
    prometheus::Gauge& step = gauge("postchain_step_under_way_seconds",
                                    "time of the longest step of the running job so far");
    prometheus::Gauge& stuck =
        gauge("postchain_stuck_threads", "threads that hang in a disk or a device");
    prometheus::Counter& replaced = counter("postchain_workers_replaced_total",
                                            "workers replaced because a step took too long");
    // Names of Prometheus's own client libraries.
    prometheus::Gauge& memory =
        gauge("process_resident_memory_bytes", "resident memory of the process");
    prometheus::Gauge& files = gauge("process_open_fds", "open files of the process");
    prometheus::Gauge& threads = gauge("process_threads", "threads of the process");
    prometheus::Counter& cpu =
        counter("process_cpu_seconds_total", "user and system time of the process");
    prometheus::Gauge& start =
        gauge("process_start_time_seconds", "start of the process since 1970");

    prometheus::Family<prometheus::Gauge>& user_jobs =
        gauges("postchain_user_jobs", "waiting and running jobs of each user");
    prometheus::Family<prometheus::Gauge>& user_frames =
        gauges("postchain_user_unfinished_frames", "frames of each user that are not done");
    prometheus::Family<prometheus::Gauge>& user_bytes =
        gauges("postchain_user_bytes", "bytes that each user's jobs have written, as max_disk");
    std::set<std::string> shown_owners;

    // Users whose last job has been removed go to 0.
    void show(const std::vector<OwnerUse>& owners) {
        std::map<std::string, OwnerUse> all;
        for (const std::string& owner : shown_owners) all[owner] = {owner};
        for (const OwnerUse& use : owners) {
            all[use.owner] = use;
            shown_owners.insert(use.owner);
        }
        for (const auto& [owner, use] : all) {
            user_jobs.Add({{"user", owner}, {"state", "queued"}}).Set(double(use.queued));
            user_jobs.Add({{"user", owner}, {"state", "running"}}).Set(double(use.running));
            user_frames.Add({{"user", owner}}).Set(double(use.frames));
            user_bytes.Add({{"user", owner}}).Set(double(use.bytes));
        }
    }

    void read_process() {
        std::ifstream status("/proc/self/statm");
        int64_t pages = 0, resident = 0;
        if (status >> pages >> resident)
            memory.Set(double(resident) * double(sysconf(_SC_PAGESIZE)));
        files.Set(double(entries_of("/proc/self/fd")));
        threads.Set(double(entries_of("/proc/self/task")));
        rusage usage = {};
        if (getrusage(RUSAGE_SELF, &usage) != 0) return;
        const auto seconds = [](const timeval& t) { return double(t.tv_sec) + t.tv_usec * 1e-6; };
        const double used = seconds(usage.ru_utime) + seconds(usage.ru_stime);
        if (used > cpu.Value()) cpu.Increment(used - cpu.Value());
    }
};

Counters::Counters(const std::string& version) : families_(std::make_unique<Families>(version)) {
    for (const auto outcome :
         {sequence::Outcome::written, sequence::Outcome::skipped, sequence::Outcome::held,
          sequence::Outcome::missing, sequence::Outcome::failed})
        families_->frames.Add({{"result", name_of(outcome)}});
    // With 0, so that a rate counts the first job of a kind too.
    for (const auto kind : {JobKind::run, JobKind::ab, JobKind::bench, JobKind::study})
        for (const auto state : {JobState::done, JobState::failed, JobState::canceled})
            families_->ended.Add({{"kind", name_of(kind)}, {"state", name_of(state)}});
    families_->start.Set(double(now_ms()) * 1e-3);
}

Counters::~Counters() = default;

void Counters::add(const sequence::FrameReport& report) noexcept try {
    Families& all = *families_;
    all.frames.Add({{"result", name_of(report.outcome)}}).Increment();
    if (!report.plan) return;
    const auto observe = [&](const char* step, double ms) {
        all.steps.Add({{"step", step}}, seconds()).Observe(ms * 1e-3);
    };
    observe("read", report.findings.read_ms);
    observe("convert", report.findings.convert_ms);
    observe("filter", report.filter_ms);
    observe("write", report.write_ms);
    for (const Elision& elision : report.plan->elisions)
        if (elision.kind == ElisionKind::pass && elision.pass >= 0)
            all.left_out
                .Add({{"pass", report.plan->passes[size_t(elision.pass)].type},
                      {"reason", elision.rule}})
                .Increment();
    all.nonfinite.Add({{"where", "input"}}).Increment(double(report.findings.health.nonfinite()));
    all.nonfinite.Add({{"where", "output"}}).Increment(double(report.output_nonfinite));
    all.textures.Set(double(report.counters.texture_bytes_peak));
    all.alive.Set(double(report.counters.textures_alive));
} catch (...) {
    // A lost count must not cost a frame.
}

void Counters::set_renderer(const std::string& renderer) noexcept try {
    families_->build.Add({{"version", families_->version}, {"renderer", renderer}}).Set(1);
} catch (...) {
}

void Counters::waited_for_previews(double seconds) noexcept {
    if (seconds > 0) families_->waits.Increment(seconds);
}

void Counters::started(double waited_s) noexcept try {
    families_->queue_wait.Observe(waited_s);
} catch (...) {
}

void Counters::ended(JobKind kind, const std::string& state) noexcept try {
    families_->ended.Add({{"kind", name_of(kind)}, {"state", state}}).Increment();
} catch (...) {
}

std::string Counters::text(const std::map<JobState, size_t>& jobs, const QueueTimes& times,
                           const std::vector<OwnerUse>& owners, const StuckThreads& stuck) const {
    const std::lock_guard lock(mutex_);
    // A clock that was set back makes no negative age.
    families_->oldest.Set(times.oldest_queued_ms
                              ? double(std::max<int64_t>(now_ms() - *times.oldest_queued_ms, 0)) *
                                    1e-3
                              : 0);
    families_->show(owners);
    families_->store.Set(double(times.store_bytes));
    families_->step.Set(stuck.oldest_step_s);
    families_->stuck.Set(double(stuck.now));
    families_->replaced.Increment(double(stuck.ever) - families_->replaced.Value());
    families_->read_process();
    for (const JobState state : kJobStates) {
        const auto found = jobs.find(state);
        families_->jobs.Add({{"state", name_of(state)}})
            .Set(found == jobs.end() ? 0 : double(found->second));
    }
    return prometheus::TextSerializer().Serialize(families_->registry.Collect());
}

}  // namespace postchain::service
