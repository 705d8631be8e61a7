// Measures the cost of each pass per megapixel and per tap, relative to a copy of the same frame.
//
//   synthetic frame -> textures on the device -> { pass, copy, pass, copy, ... } -> medians
//
// Timing rules: docs/performance.md. Wall-clock time around glFinish on a software renderer, GL
// timestamps on a GPU (chain/gl/clock.h), Vulkan's timestamps with --vulkan. After two warm-up
// runs, pass and copy alternate in one queue, so that both see the same load; median and quartiles
// are reported. The reference bandwidth is measured first, with the same copy of a frame of
// 3840x2160. B/px are the bytes that the plan moves per pixel (chain/plan/plan_bytes.h), GB/s those
// bytes over the median time. A tap is a texture fetch as counted by the plan (Step::taps): an
// upper bound if a shader exits early, as motion blur does on still tiles; for FXAA those of an
// edge without the walk along it. MiB are the textures of one run, apart from the frame's own
// planes.
#include <cstdio>
#include <map>

#include "chain/guest/presets.h"
#include "chain/pass/planner.h"
#include "chain/plan/plan_bytes.h"
#include "passes/registry.h"
#include "tests/bench/bench_device.h"
#include "tests/bench/bench_frame.h"

namespace {

using namespace postchain;
using namespace postchain::bench;

struct Case {
    std::string name;
    std::vector<guest::Tier::Pass> passes;  // none = the copy itself
};

std::vector<Case> cases() {
    using Text = std::string;
    std::vector<Case> all = {{"copy", {}}};
    for (const guest::Tier& tier : guest::tiers()) all.push_back({tier.name, tier.passes});
    for (const char* pass : {"motion_blur", "depth_of_field"}) all.push_back({pass, {{pass, {}}}});
    for (const char* mode : {"guertin", "single"})
        for (const int samples : {5, 9, 13, 25, 51, 101})
            all.push_back(
                {concat("motion_blur/", mode, "/", samples),
                 {{"motion_blur", {{"mode", Text(mode)}, {"samples", int64_t(samples)}}}}});
    for (const int preset : {10, 12, 29, 39})
        all.push_back({concat("fxaa/", preset), {{"fxaa", {{"preset", int64_t(preset)}}}}});
    all.push_back({"fxaa/directional", {{"fxaa", {{"mode", Text("directional")}}}}});
    for (const char* leak : {"none", "depth", "coc"})
        for (const int downsample : {1, 2, 4})
            all.push_back({concat("depth_of_field/", leak, "/", downsample),
                           {{"depth_of_field",
                             {{"method", Text("gilham")},
                              {"leak", Text(leak)},
                              {"downsample", int64_t(downsample)}}}}});
    return all;
}

Plan plan_of(const Case& one, const BenchFrame& frame, const PlanOptions& options) {
    Chain chain;
    for (const auto& [name, values] : one.passes) {
        Pass* pass = chain.append(builtin_passes(), name);
        if (!pass) fail(concat("no pass ", name));
        const ParameterTable& table = *chain.links.back().type->parameters;
        for (const auto& [key, value] : values) require(table.set(pass->parameters(), key, value));
    }
    return require(make_plan(chain, frame.description, options));
}

// The same work `times` times in one queue: a GPU must not wait for the next dispatch.
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

constexpr double kPanPx = 12;  // a frame, with --moving

// GL guarantees larger textures.
constexpr int kBandwidthWidth = 3840, kBandwidthHeight = 2160;

// Times of a plan's steps or passes over all runs; each run is summed over the plan.
class Sums {
  public:
    // `time` of a plan that repeats `passes` passes.
    void add(const PassTime& time, size_t passes) {
        const size_t repeat = size_t(time.pass) / passes;
        if (repeat >= sums_.size()) sums_.resize(repeat + 1, 0);
        sums_[repeat] += time.milliseconds;
    }
    void end_run() {
        all_.insert(all_.end(), sums_.begin(), sums_.end());
        sums_.clear();
    }
    const std::vector<double>& all() const { return all_; }

  private:
    std::vector<double> sums_, all_;
};

class Bench {
  public:
    Bench(const Settings& settings, BenchFrame frame, const PlanOptions& options, bool steps,
          BenchDevice& device)
        : settings_(settings),
          options_(options),
          steps_(steps),
          device_(device),
          frame_(std::move(frame)) {}
    const BenchFrame& frame() const { return frame_; }
    // Another frame of the same size.
    void set_frame(BenchFrame frame, bool elides) {
        frame_ = std::move(frame);
        options_.elide = elides;
        device_.set_planes(frame_.planes);
    }
    double bandwidth() const { return bandwidth_; }

    // GB/s of a copy of a frame too large for caches; on a software renderer, of a frame of this
    // size.
    void measure_bandwidth() {
        Plan plan;
        plan.width = device_.software() ? settings_.width : kBandwidthWidth;
        plan.height = device_.software() ? settings_.height : kBandwidthHeight;
        add_copy(plan, plan.width, plan.height);
        const double bytes = bytes_per_pixel(plan) * plan.width * plan.height;
        FramePlanes planes;
        planes[Role::color] = ImageF(plan.width, plan.height, 4, 0.5f);
        device_.set_planes(planes);
        repeat(plan, device_.software() ? 1 : 16);
        std::vector<double> times;
        for (int i = 0; i < 2 + settings_.iterations; ++i) {
            for (const PassTime& time : device_.run(plan))
                if (i >= 2) times.push_back(time.milliseconds);
        }
        device_.set_planes(frame_.planes);
        bandwidth_ = 1e-6 * bytes / quantile(times, 0.5);
    }

    // Prints a row, and one for each step.
    void run(const Case& one) {
        Plan plan = plan_of(one, frame_, options_);
        double taps = 0;
        for (const Step& step : plan.steps) taps += double(step.taps);
        double bytes_px = bytes_per_pixel(plan);
        const double mebibytes = device_.bytes_of(plan) / (1 << 20);
        add_copy(plan, settings_.width, settings_.height);
        if (one.passes.empty()) {
            taps = double(plan.steps[0].taps);
            bytes_px = bytes_per_pixel(plan);
        }
        const Plan once = plan;
        const size_t passes = plan.passes.size();
        repeat(plan, device_.software() ? 1 : 16);
        for (int i = 0; i < 2; ++i) device_.run(plan);

        Sums times, copies;
        std::map<std::string, Sums> by_name;
        for (int i = 0; i < settings_.iterations; ++i) {
            for (const PassTime& time : device_.run(plan)) {
                const bool copy = time.name.starts_with("copy");
                (copy ? copies : times).add(time, passes);
                if (steps_ && !copy)
                    by_name[concat(size_t(time.pass) % passes, ".", time.name)].add(time, passes);
            }
            times.end_run();
            copies.end_run();
            for (auto& [name, sums] : by_name) sums.end_run();
        }
        const std::vector<double>& all = one.passes.empty() ? copies.all() : times.all();
        const double megapixels = 1e-6 * settings_.width * settings_.height;
        const double median = quantile(all, 0.5);
        const double rate = bytes_px * megapixels / median;
        std::printf("%-36s %9.4f %8.4f-%8.4f %9.4f %7.1f %7.2f %6.1f %8.1f %9.4f %6.0f %8.2f\n",
                    one.name.c_str(), median, quantile(all, 0.25), quantile(all, 0.75),
                    median / megapixels, bytes_px, rate, 100 * rate / bandwidth_,
                    taps / (1e6 * megapixels), 1e6 * median / taps, mebibytes,
                    median / quantile(copies.all(), 0.5));
        if (steps_ && !one.passes.empty()) print_steps(once, by_name, megapixels);
        std::fflush(stdout);
    }

  private:
    void print_steps(const Plan& plan, const std::map<std::string, Sums>& by_name,
                     double megapixels) {
        const std::vector<StepBytes> bytes = bytes_of_steps(plan);
        for (size_t i = 0; i < plan.steps.size(); ++i) {
            const Step& step = plan.steps[i];
            const std::string name = plan.name_of(step);
            const auto sums = by_name.find(concat(step.pass, ".", name));
            if (sums == by_name.end()) continue;
            const double median = quantile(sums->second.all(), 0.5);
            const double bytes_px = double(bytes[i].moved()) / (1e6 * megapixels);
            const double rate = bytes_px * megapixels / median;
            std::printf("  %-34s %9.4f %17s %9.4f %7.1f %7.2f %6.1f\n", name.c_str(), median, "",
                        median / megapixels, bytes_px, rate, 100 * rate / bandwidth_);
        }
    }

    Settings settings_;
    PlanOptions options_;
    bool steps_;
    BenchDevice& device_;
    double bandwidth_ = 0;
    BenchFrame frame_;
};

}  // namespace

int main(int argc, char** argv) {
    Arguments arguments(argc, argv,
                        concat("gpu_bench ", kSettingsUsage,
                               " [--only=PART_OF_NAME] [--steps] [--moving] [--halves] "
                               "[--fast-math] [--vulkan]"));
    const Settings settings = take_settings(arguments, 11);
    const std::string only = arguments.text("--only").value_or("");
    const bool steps = arguments.flag("--steps");
    const double pan_px = arguments.flag("--moving") ? kPanPx : 0;
    PlanOptions options;
    options.elide = false;
    if (arguments.flag("--halves")) options.precision = Precision::fp16;
    options.fast_math = arguments.flag("--fast-math");
    const bool vulkan = arguments.flag("--vulkan");
    arguments.none();
    const auto device = vulkan ? vulkan_bench_device(steps) : gl_bench_device(steps);
    options.device = device->device_class();
    Bench bench(settings, make_frame(settings.width, settings.height, pan_px), options, steps,
                *device);
    std::printf("%s\n", device->text().c_str());
    std::printf("clock: %s; %dx%d, %s, %.0f %% of the pixels still; median of %d\n",
                device->clock(), settings.width, settings.height,
                options.precision == Precision::fp16 ? "fp16" : "fp32", 100 * bench.frame().still,
                settings.iterations);
    bench.measure_bandwidth();
    std::printf("bandwidth of a copy: %.1f GB/s; share: GB/s in percent of it\n",
                bench.bandwidth());
    std::printf("copies: time as a multiple of a copy of the frame, measured alternately\n");
    std::printf("%-36s %9s %17s %9s %7s %7s %6s %8s %9s %6s %8s\n", "pass", "ms", "quartiles",
                "ms/Mpx", "B/px", "GB/s", "share", "taps/px", "ns/tap", "MiB", "copies");
    for (const Case& one : cases())
        if (one.name.find(only) != std::string::npos) bench.run(one);
    for (const auto& [scene, name] : kScenes) {
        bench.set_frame(make_frame(settings.width, settings.height, scene), true);
        for (const guest::Tier& tier : guest::tiers())
            if (const Case one = {concat(name, "/", tier.name), tier.passes};
                one.name.find(only) != std::string::npos)
                bench.run(one);
    }
    return 0;
}
