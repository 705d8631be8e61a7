// Measures elision: the time of an elided run relative to a complete run, and the cost of a still
// frame relative to a copy.
//
//   frame on the device -> { complete, elided with facts, elided without, complete, ... } -> ratios
//   -> quartiles
//
// "With facts" models a sequence, whose facts are found while a frame is converted; "without" an
// engine, which reads nothing back and sorts blocks on the device. Timing rules and results:
// docs/benchmarks.md.
#include <cstdio>

#include "chain/convert.h"
#include "chain/egl/context.h"
#include "chain/planner.h"
#include "passes/registry.h"
#include "tests/bench/bench_frame.h"

namespace {

using namespace postchain;
using namespace postchain::bench;

enum class Motion { none, pan, disc, all };
enum class Focus { layers, all, half, none, partly };

struct Scene {
    const char* name;
    Motion motion;
    Focus focus;
};

// layers: sky and ground out of focus, the disc in focus. partly: every radius is between sharp and
// fully blurred.
constexpr Scene kScenes[] = {
    {"still", Motion::none, Focus::layers},
    {"pan", Motion::pan, Focus::layers},
    {"one moving object", Motion::disc, Focus::layers},
    {"all moving", Motion::all, Focus::layers},
    {"all in focus", Motion::pan, Focus::all},
    {"half in focus", Motion::pan, Focus::half},
    {"all out of focus", Motion::pan, Focus::none},
    {"nothing to leave out", Motion::all, Focus::partly},
};

// The frame of the other benchmarks with its own motion and depth. Its lens: 50 mm at f/1.8, focus
// at 2 units; at 1280 px width R = 24.7 (1/2 - w) px, fully blurred from 6.2 px on.
BenchFrame make_scene(const Scene& scene, int width, int height) {
    BenchFrame frame = make_frame("mixed", width, height);
    ImageF& motion = frame.planes[Role::motion];
    ImageF& depth = frame.planes[Role::inverse_depth];
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
            float* v = motion.pixel(x, y);
            float& w = depth.at(x, y);
            if (scene.motion == Motion::none || (scene.motion == Motion::disc && w != 0.5f))
                v[0] = v[1] = 0;
            if (scene.motion == Motion::pan) {
                v[0] = 24.3f;
                v[1] = -7.1f;
            }
            if (scene.motion == Motion::all) {  // turns about a point above the image
                v[0] = 40.0f * (1.0f + float(y) / float(height));
                v[1] = 40.0f * (0.5f - float(x) / float(width));
            }
            if (scene.focus == Focus::all) w = 0.5f;
            if (scene.focus == Focus::none) w = 0.05f;
            if (scene.focus == Focus::half) w = 2 * x < width ? 0.5f : 0.05f;
            if (scene.focus == Focus::partly) w = 0.46f - 0.2f * float(x) / float(width);
        }
    ConvertOptions options;
    options.depth = DepthEncoding::inverse;
    require(convert_frame(frame.planes, frame.description, options));
    return frame;
}

// "paper" and "dof_first" as in config/chains.
Chain make_chain(const std::string& name) {
    std::vector<std::string> types = {name};
    if (name == "paper") types = {"motion_blur", "fxaa", "depth_of_field"};
    if (name == "dof_first") types = {"depth_of_field", "motion_blur", "fxaa"};
    Chain chain;
    for (const std::string& type : types) {
        Pass* pass = chain.append(builtin_passes(), type);
        if (!pass) fail("no pass " + type);
        if (type != "fxaa") continue;
        const ParameterTable& table = *chain.links.back().type->parameters;
        require(table.set(pass->parameters(), "hint", std::string("checkerboard")));
        require(table.set(pass->parameters(), "hint_gate", std::string("tile")));
    }
    return chain;
}

bool reads(const std::string& chain, const Scene& scene) {
    if (chain == "motion_blur") return scene.focus == Focus::layers || scene.motion == Motion::all;
    if (chain == "depth_of_field")
        return scene.focus != Focus::layers || scene.motion == Motion::none;
    return true;
}

struct Times {
    std::vector<double> wall, cpu;  // milliseconds
};

void print(const std::vector<double>& a, const std::vector<double>& b) {
    std::vector<double> ratios;
    for (size_t i = 0; i < a.size(); ++i) ratios.push_back(a[i] / b[i]);
    std::printf("  %5.2f %4.2f-%4.2f", quantile(ratios, 0.5), quantile(ratios, 0.25),
                quantile(ratios, 0.75));
}

class Bench {
  public:
    Bench(const Settings& settings, const gl::Device& device)
        : settings_(settings), software_(device.software), executor_(device) {
        executor_.set_timing(true);
    }
    const char* timing_source() const { return executor_.timing_source(); }

    void run(const std::string& chain_name, const Scene& scene) {
        const std::string name = concat(chain_name, ", ", scene.name);
        if (name.find(settings_.only) == std::string::npos) return;
        const BenchFrame frame = make_scene(scene, settings_.width, settings_.height);
        DevicePlanes planes(frame.planes);
        const Chain chain = make_chain(chain_name);
        PlanOptions all;
        all.elide = false;
        FrameDescription unknown = frame.description;
        unknown.bounds = FrameBounds();
        const Plan plans[] = {require(make_plan(chain, frame.description, all)),
                              require(make_plan(chain, frame.description)),
                              require(make_plan(chain, unknown))};
        Times times[3];
        for (int i = -2; i < settings_.iterations; ++i)
            for (int which = 0; which < 3; ++which) {
                const auto [wall, cpu] = time_of(plans[which], planes);
                if (i < 0) continue;
                times[which].wall.push_back(wall);
                times[which].cpu.push_back(cpu);
            }
        std::printf("%-38s %9.3f", name.c_str(), quantile(times[0].wall, 0.5));
        for (const int which : {1, 2}) {
            print(times[which].wall, times[0].wall);
            if (software_) print(times[which].cpu, times[0].cpu);
        }
        std::printf("  %2zu %2zu %2zu\n", plans[0].steps.size(), plans[1].steps.size(),
                    plans[2].steps.size());
        std::fflush(stdout);
    }

    // Steps launched by work lists process pixels; earlier steps sort blocks. The whole plan, the
    // sorting and a copy run in turn.
    void run_against_copy(const std::string& chain_name, const Scene& scene) {
        const std::string name = concat(chain_name, ", ", scene.name);
        if (name.find(settings_.only) == std::string::npos) return;
        const BenchFrame frame = make_scene(scene, settings_.width, settings_.height);
        DevicePlanes planes(frame.planes);
        FrameDescription unknown = frame.description;
        unknown.bounds = FrameBounds();
        Plan plans[3];
        plans[0] = plans[1] = require(make_plan(make_chain(chain_name), unknown));
        while (plans[1].steps.back().work_list >= 0) plans[1].steps.pop_back();
        for (const Step& step : plans[1].steps)
            if (step.work_list >= 0) fail("steps launched by work lists are not the last");
        add_copy(plans[2], settings_.width, settings_.height);
        Times times[3];
        for (int i = -2; i < 4 * settings_.iterations; ++i)
            for (int which = 0; which < 3; ++which) {
                const auto [wall, cpu] = time_of(plans[which], planes);
                if (i < 0) continue;
                times[which].wall.push_back(wall);
                times[which].cpu.push_back(cpu);
            }
        for (const auto& values : {&Times::wall, &Times::cpu}) {
            std::vector<double>&whole = times[0].*values, &sorting = times[1].*values;
            for (size_t i = 0; i < whole.size(); ++i) whole[i] -= sorting[i];
        }
        std::printf("%-38s %9.3f", name.c_str(), quantile(times[2].wall, 0.5));
        for (const int which : {0, 1}) {
            print(times[which].wall, times[2].wall);
            if (software_) print(times[which].cpu, times[2].cpu);
        }
        std::printf("\n");
        std::fflush(stdout);
    }

  private:
    struct Time {
        double wall, cpu;
    };
    Time time_of(const Plan& plan, DevicePlanes& planes) {
        const auto inputs = planes.inputs_of(plan);
        const double before = cpu_milliseconds();
        require(executor_.run(plan, inputs));
        double wall = 0;
        if (!plan.steps.empty())  // otherwise there is nothing to wait for
            for (const PassTime& time : finished_times(executor_)) wall += time.milliseconds;
        return {wall, cpu_milliseconds() - before};
    }

    Settings settings_;
    bool software_;
    Executor executor_;
};

}  // namespace

int main(int argc, char** argv) {
    const Settings settings = parse_settings(argc, argv, 11);
    const auto context = require(egl::Context::create());
    Bench bench(settings, context->device());
    std::printf("%s\nclock: %s; %dx%d; median and quartiles of %d runs by turns\n\n",
                device_text(context->device()).c_str(), bench.timing_source(), settings.width,
                settings.height, settings.iterations);
    const auto head = [&](const char* name, const char* unit, const char* first,
                          const char* second) {
        std::printf("%-38s %9s", name, unit);
        for (const char* column : {first, second}) {
            std::printf("%17s", column);
            if (context->device().software) std::printf("%17s", "CPU time");
        }
    };
    head("elided / complete", "full ms", "facts known", "unknown");
    std::printf("  steps\n");
    for (const char* chain : {"motion_blur", "depth_of_field", "paper", "dof_first"})
        for (const Scene& scene : kScenes)
            if (reads(chain, scene)) bench.run(chain, scene);
    std::printf("\n");
    head("facts unknown, in copies", "copy ms", "pixels' own", "sorting");
    std::printf("\n");
    bench.run_against_copy("motion_blur", kScenes[0]);
    bench.run_against_copy("depth_of_field", kScenes[4]);
    return 0;
}
