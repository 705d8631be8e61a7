#include "tools/service/work/counters.h"

#include <prometheus/counter.h>
#include <prometheus/gauge.h>
#include <prometheus/histogram.h>
#include <prometheus/registry.h>
#include <prometheus/text_serializer.h>

namespace postchain::service {
namespace {

const prometheus::Histogram::BucketBoundaries& seconds() {
    static const prometheus::Histogram::BucketBoundaries bounds = {
        0.001, 0.003, 0.01, 0.03, 0.1, 0.3, 1, 3, 10, 30, 100, 300};
    return bounds;
}

}  // namespace

struct Counters::Families {
    explicit Families(const std::string& v) : version(v) {}

    const std::string version;
    prometheus::Registry registry;
    prometheus::Family<prometheus::Counter>& frames = prometheus::BuildCounter()
                                                          .Name("postchain_frames_total")
                                                          .Help("frames of jobs by result")
                                                          .Register(registry);
    prometheus::Family<prometheus::Histogram>& steps =
        prometheus::BuildHistogram()
            .Name("postchain_step_seconds")
            .Help("time of each step of a frame: read, convert, filter, write")
            .Register(registry);
    prometheus::Family<prometheus::Counter>& left_out = prometheus::BuildCounter()
                                                            .Name("postchain_passes_left_out_total")
                                                            .Help("elided passes by pass and rule")
                                                            .Register(registry);
    prometheus::Family<prometheus::Counter>& nonfinite =
        prometheus::BuildCounter()
            .Name("postchain_nonfinite_pixels_total")
            .Help("pixels with NaN or Inf in input and output")
            .Register(registry);
    prometheus::Family<prometheus::Gauge>& jobs = prometheus::BuildGauge()
                                                      .Name("postchain_jobs")
                                                      .Help("jobs in the store by state")
                                                      .Register(registry);
    prometheus::Gauge& textures = prometheus::BuildGauge()
                                      .Name("postchain_texture_bytes_peak")
                                      .Help("peak bytes of allocated textures")
                                      .Register(registry)
                                      .Add({});
    prometheus::Gauge& alive = prometheus::BuildGauge()
                                   .Name("postchain_textures")
                                   .Help("textures allocated after the last frame")
                                   .Register(registry)
                                   .Add({});
    prometheus::Family<prometheus::Gauge>& build = prometheus::BuildGauge()
                                                       .Name("postchain_build_info")
                                                       .Help("1, with version and GL renderer")
                                                       .Register(registry);
};

Counters::Counters(const std::string& version) : families_(std::make_unique<Families>(version)) {
    for (const auto outcome : {sequence::Outcome::written, sequence::Outcome::skipped,
                               sequence::Outcome::missing, sequence::Outcome::failed})
        families_->frames.Add({{"result", name_of(outcome)}});
}

Counters::~Counters() = default;

void Counters::add(const sequence::FrameReport& report) noexcept try {
    Families& all = *families_;
    all.frames.Add({{"result", name_of(report.outcome)}}).Increment();
    if (!report.plan) return;
    const auto observe = [&](const char* step, double ms) {
        all.steps.Add({{"step", step}}, seconds()).Observe(ms * 1e-3);
    };
    observe("read", report.read_ms);
    observe("convert", report.convert_ms);
    observe("filter", report.filter_ms);
    observe("write", report.write_ms);
    for (const Elision& elision : report.plan->elisions)
        if (elision.kind == ElisionKind::pass && elision.pass >= 0)
            all.left_out
                .Add({{"pass", report.plan->passes[size_t(elision.pass)].type},
                      {"reason", elision.rule}})
                .Increment();
    all.nonfinite.Add({{"where", "input"}}).Increment(double(report.health.nonfinite()));
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

std::string Counters::text(const std::map<JobState, size_t>& jobs) const {
    for (const JobState state : kJobStates) {
        const auto found = jobs.find(state);
        families_->jobs.Add({{"state", name_of(state)}})
            .Set(found == jobs.end() ? 0 : double(found->second));
    }
    return prometheus::TextSerializer().Serialize(families_->registry.Collect());
}

}  // namespace postchain::service
