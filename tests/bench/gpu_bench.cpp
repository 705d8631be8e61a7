// What each pass costs per megapixel and per tap, beside a plain copy of the same frame.
//
//   synthetic frame -> textures on the device -> { pass, copy, pass, copy, ... } -> medians
//
// Rules of time: docs/benchmarks.md. The wall clock around glFinish on a software renderer, GL
// timestamps on a GPU (chain/gl/clock.h); two runs to warm up; pass and copy take turns inside one
// queue, so that both see the same machine; median and quartiles are reported.
// B/px are the bytes that the plan moves for each pixel (chain/plan_bytes.h), GB/s those over the
// median. A tap is a texture fetch by the plan's own count (Step::taps): a bound where a shader
// leaves early, as motion blur does on still tiles, and a floor for FXAA, which fetches more along
// edges.
#include <benchmark/benchmark.h>

#include <cstdio>

#include "chain/egl/context.h"
#include "chain/plan_bytes.h"
#include "chain/planner.h"
#include "passes/registry.h"
#include "tests/bench/bench_frame.h"

namespace {

using namespace postchain;
using namespace postchain::bench;

using Values = std::vector<std::pair<std::string, ParameterValue>>;

struct Case {
    std::string name;
    std::string pass;  // empty: the copy itself
    Values values;
};

std::vector<Case> cases() {
    std::vector<Case> all = {{"copy", "", {}}};
    for (const char* mode : {"guertin", "single"})
        for (const int samples : {5, 9, 13, 25, 51, 101})
            all.push_back({concat("motion_blur/", mode, "/", samples),
                           "motion_blur",
                           {{"mode", std::string(mode)}, {"samples", int64_t(samples)}}});
    for (const int preset : {10, 12, 29, 39})
        all.push_back({concat("fxaa/", preset), "fxaa", {{"preset", int64_t(preset)}}});
    all.push_back({"fxaa/directional", "fxaa", {{"mode", std::string("directional")}}});
    for (const char* leak : {"none", "depth", "coc"})
        for (const int downsample : {1, 2, 4})
            all.push_back({concat("depth_of_field/", leak, "/", downsample),
                           "depth_of_field",
                           {{"leak", std::string(leak)}, {"downsample", int64_t(downsample)}}});
    return all;
}

Plan plan_of(const Case& one, const BenchFrame& frame) {
    Chain chain;
    if (!one.pass.empty()) {
        Pass* pass = chain.append(builtin_passes(), one.pass);
        if (!pass) fail("no pass " + one.pass);
        const ParameterTable& table = *chain.links[0].type->parameters;
        for (const auto& [key, value] : one.values)
            require(table.set(pass->parameters(), key, value));
    }
    PlanOptions options;
    options.elide = false;
    return require(make_plan(chain, frame.description, options));
}

// The same work `times` times over in one queue: a GPU must not wait for the next dispatch.
void repeat(Plan& plan, int times) {
    const std::vector<Step> steps = plan.steps;
    const std::vector<PlanPass> passes = plan.passes;
    for (int i = 1; i < times; ++i) {
        for (Step step : steps) {
            step.pass += i * int(passes.size());
            plan.steps.push_back(std::move(step));
        }
        plan.passes.insert(plan.passes.end(), passes.begin(), passes.end());
    }
    for (PlanTexture& texture : plan.textures)
        if (texture.last_step >= 0) texture.last_step += (times - 1) * int(steps.size());
}

class Bench {
  public:
    Bench(const Settings& settings, const gl::Device& device)
        : settings_(settings),
          software_(device.software),
          executor_(device),
          frame_(make_frame("mixed", settings.width, settings.height)),
          planes_(frame_.planes) {
        executor_.set_timing(true);
    }
    const BenchFrame& frame() const { return frame_; }
    const char* timing_source() const { return executor_.timing_source(); }

    void run(benchmark::State& state, const Case& one) {
        Plan plan = plan_of(one, frame_);
        double taps = 0;
        for (const Step& step : plan.steps) taps += double(step.taps);
        double bytes_px = bytes_per_pixel(plan);
        add_copy(plan, settings_.width, settings_.height);
        if (one.pass.empty()) {
            taps = double(plan.steps[0].taps);
            bytes_px = bytes_per_pixel(plan);
        }
        repeat(plan, software_ ? 1 : 16);
        const auto inputs = planes_.inputs_of(plan);
        for (int i = 0; i < 2; ++i) require(executor_.run(plan, inputs));

        std::vector<double> times, copies;
        for (auto _ : state) {
            require(executor_.run(plan, inputs));
            double seconds = 0;
            for (const PassTime& time : finished_times(executor_)) {
                (time.name == "copy" ? copies : times).push_back(time.milliseconds);
                seconds += 1e-3 * time.milliseconds;
            }
            state.SetIterationTime(seconds);
        }
        if (one.pass.empty()) times = copies;
        const double megapixels = 1e-6 * settings_.width * settings_.height;
        const double median = quantile(times, 0.5);
        state.counters["ms"] = median;
        state.counters["low"] = quantile(times, 0.25);
        state.counters["high"] = quantile(times, 0.75);
        state.counters["ms/Mpx"] = median / megapixels;
        state.counters["B/px"] = bytes_px;
        state.counters["GB/s"] = bytes_px * megapixels / median;
        state.counters["taps/px"] = taps / (1e6 * megapixels);
        state.counters["ns/tap"] = 1e6 * median / taps;
        state.counters["copies"] = median / quantile(copies, 0.5);
    }

  private:
    Settings settings_;
    bool software_;
    Executor executor_;
    BenchFrame frame_;
    DevicePlanes planes_;
};

class Table : public benchmark::BenchmarkReporter {
  public:
    bool ReportContext(const Context&) override {
        std::printf("%-26s %9s %17s %9s %7s %7s %8s %9s %8s\n", "pass", "ms", "quartiles", "ms/Mpx",
                    "B/px", "GB/s", "taps/px", "ns/tap", "copies");
        return true;
    }
    void ReportRuns(const std::vector<Run>& runs) override {
        for (const Run& run : runs) {
            const auto value = [&](const char* key) { return run.counters.at(key).value; };
            std::printf("%-26s %9.3f %8.3f-%8.3f %9.3f %7.1f %7.2f %8.1f %9.4f %8.2f\n",
                        run.run_name.function_name.c_str(), value("ms"), value("low"),
                        value("high"), value("ms/Mpx"), value("B/px"), value("GB/s"),
                        value("taps/px"), value("ns/tap"), value("copies"));
            std::fflush(stdout);
        }
    }
};

// Takes our own arguments out of argv.
}  // namespace

int main(int argc, char** argv) {
    const Settings settings = take_settings(argc, argv, 11);
    benchmark::Initialize(&argc, argv);
    if (benchmark::ReportUnrecognizedArguments(argc, argv)) {
        std::fprintf(stderr, "also: --size=WIDTHxHEIGHT --iterations=N --only=PART_OF_NAME\n");
        return 2;
    }
    const auto context = require(egl::Context::create());
    Bench bench(settings, context->device());
    std::printf("%s\n", device_text(context->device()).c_str());
    std::printf("clock: %s; %dx%d, fp32, %.0f %% of the pixels still; median of %d\n",
                bench.timing_source(), settings.width, settings.height, 100 * bench.frame().still,
                settings.iterations);
    std::printf("copies: time as a multiple of a plain copy of the frame, measured in turn\n");
    const std::vector<Case> all = cases();
    for (const Case& one : all) {
        if (one.name.find(settings.only) == std::string::npos) continue;
        benchmark::RegisterBenchmark(
            one.name.c_str(), [&bench, one](benchmark::State& state) { bench.run(state, one); })
            ->UseManualTime()
            ->Iterations(settings.iterations);
    }
    Table table;
    benchmark::RunSpecifiedBenchmarks(&table);
    benchmark::Shutdown();
    return 0;
}
