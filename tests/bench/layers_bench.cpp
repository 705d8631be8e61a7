// Measures the cost of extra layers: bytes, taps, time and CPU time of each pass with none, one,
// four and eight layers, and with the coverage of 70 ids in 18 layers, relative to none. Runs
// alternate, so that other load affects all of them.
// CPU time covers all threads of the process, with upload and readback: for a software renderer it
// is the work itself, independent of other load.
//
//   layers_bench [runs [width height [PASS]]]   PASS: only passes whose name starts with it
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <string>

#include "chain/egl/context.h"
#include "chain/gl/executor.h"
#include "chain/layers.h"
#include "chain/plan_bytes.h"
#include "chain/planner.h"
#include "passes/registry.h"
#include "tests/bench/bench_frame.h"

using namespace postchain;

namespace {

struct Case {
    const char* name;
    const char* pass;
    std::vector<std::pair<const char*, ParameterValue>> settings;
};

constexpr int kIds = 70;  // on a grid of 10 x 7, each where it is; four to a layer
const std::vector<int> kCounts = {0, 1, 4, 8, (kIds + 3) / 4};

ImageF layers_of(const ImageF& color, int count) {
    if (count < kCounts.back()) return stack_planes(std::vector<ImageF>(size_t(count), color));
    ImageF stack(color.width, color.height * count, 4);
    for (int y = 0; y < color.height; ++y)
        for (int x = 0; x < color.width; ++x) {
            const int id = 10 * (7 * y / color.height) + 10 * x / color.width;
            stack.at(x, y + id / 4 * color.height, id % 4) = 1;
        }
    return stack;
}

Chain chain_of(const Case& one) {
    Chain chain;
    Pass* pass = chain.append(builtin_passes(), one.pass);
    for (const auto& [key, value] : one.settings)
        bench::require(chain.links[0].type->parameters->set(pass->parameters(), key, value));
    return chain;
}

struct Times {
    std::vector<double> device_ms, cpu_ms;
};

void measure(Executor& executor, const Plan& plan, const FramePlanes& planes, Times* times) {
    const double begin = bench::cpu_milliseconds();
    bench::require(executor.filter(plan, planes).status());
    if (!times) return;
    times->cpu_ms.push_back(bench::cpu_milliseconds() - begin);
    double sum = 0;
    for (const PassTime& time : executor.pass_times()) sum += time.milliseconds;
    times->device_ms.push_back(sum);
}

double median(std::vector<double> values) {
    std::sort(values.begin(), values.end());
    return values[values.size() / 2];
}

}  // namespace

int main(int count, char** words) {
    const int runs = count > 1 ? std::atoi(words[1]) : 5;
    const int width = count > 3 ? std::atoi(words[2]) : 640;
    const int height = count > 3 ? std::atoi(words[3]) : 360;
    const std::vector<Case> cases = {
        {"motion_blur", "motion_blur", {}},
        {"motion_blur: {mode: guertin}", "motion_blur", {{"mode", "guertin"}}},
        {"depth_of_field", "depth_of_field", {}},
        {"depth_of_field: {method: gilham}", "depth_of_field", {{"method", "gilham"}}},
        {"joint_blur", "joint_blur", {}},
        {"fxaa", "fxaa", {}},
        {"fxaa: {mode: directional}", "fxaa", {{"mode", "directional"}}}};
    const std::string only = count > 4 ? words[4] : "";
    auto context = egl::Context::create();
    bench::require(context.status());
    Executor executor((*context)->device());
    executor.set_timing(true);
    bench::BenchFrame frame = bench::make_frame("mixed", width, height);
    std::printf(
        "%dx%d, median of %d; bytes a pixel, taps a pixel, time, CPU time, and as parts of no "
        "layers\n",
        width, height, runs);
    for (const Case& one : cases) {
        if (!std::string(one.name).starts_with(only)) continue;
        const Chain chain = chain_of(one);
        std::vector<Plan> plans;
        std::vector<FramePlanes> planes;
        for (const int layers : kCounts) {
            FrameDescription description = frame.description;
            planes.push_back(frame.planes);
            if (layers > 0) {
                planes.back()[Role::layers] = layers_of(frame.planes.at(Role::color), layers);
                description.layers = layers;
                description.planes.add(Role::layers);
            }
            auto plan = make_plan(chain, description);
            bench::require(plan.status());
            plans.push_back(std::move(*plan));
        }
        std::vector<Times> times(kCounts.size());
        for (int run = -1; run < runs; ++run)  // the first run compiles
            for (size_t i = 0; i < kCounts.size(); ++i)
                measure(executor, plans[i], planes[i], run < 0 ? nullptr : &times[i]);
        std::printf("%s\n", one.name);
        double first_bytes = 0, first_taps = 0, first_ms = 0, first_cpu = 0;
        for (size_t i = 0; i < kCounts.size(); ++i) {
            const double ms = median(times[i].device_ms), cpu = median(times[i].cpu_ms);
            double taps = 0;
            for (const Step& step : plans[i].steps) taps += double(step.taps);
            taps /= double(width) * height;
            const double bytes = bytes_per_pixel(plans[i]);
            if (i == 0) {
                first_bytes = bytes;
                first_taps = taps;
                first_ms = ms;
                first_cpu = cpu;
            }
            std::printf(
                "  %d layers  %2zu steps  %7.1f bytes %5.2f  %6.1f taps %5.2f  %8.2f ms %5.2f  "
                "%8.2f ms CPU "
                "%5.2f\n",
                kCounts[i], plans[i].steps.size(), bytes, bytes / first_bytes, taps,
                taps / first_taps, ms, ms / first_ms, cpu, cpu / first_cpu);
        }
    }
}
