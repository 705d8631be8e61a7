// Prints the CPU time of each step of chains (milliseconds a frame, of all threads), as Markdown
// tables, and their sums as ratios to the filter of the 2013 report.
//
//   frames --plan--> steps --between the debug groups of the executor: glFinish, CPU clock--> ms
//
//   steps_bench [--input=PATTERN [--frames=RANGE] [--camera=FILE]] [--size=WIDTHxHEIGHT]
//               [--iterations=N] [--steps] [--first] [--json=FILE] [CHAIN...]
//
// CHAIN: a chain file, a shipped chain, or a pass with its defaults; default: motion_blur,
// depth_of_field and the shipped chains. `guertin` (the report's motion blur, 25 samples) and
// `paper` are always measured. Without --input: the synthetic frame of gpu_bench, without
// neighbors. Chains alternate in each iteration. A step's time is the least of its iterations on
// each frame, then the mean over the frames; all bands of a step count. --steps: a table of the
// steps too. --first: and one of each step's first dispatch, in which a software renderer compiles
// (MESA_SHADER_CACHE_DISABLE=1).
#include <epoxy/gl.h>

#include <algorithm>
#include <cstdio>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>

#include "chain/egl/context.h"
#include "chain/pass/depth_at.h"
#include "chain/pass/planner.h"
#include "config/chain_find.h"
#include "passes/registry.h"
#include "tests/bench/bench_frame.h"
#include "tests/bench/shot.h"

namespace {

using namespace postchain;
using namespace postchain::bench;

// ------------------------------------------------------------------------------------- the clock
std::vector<double> g_times;  // of the steps of the present plan, milliseconds
double g_began = 0;

void begin_step(GLenum, GLuint, GLsizei, const GLchar*) {
    glFinish();
    g_began = cpu_milliseconds();
}

void end_step() {
    glFinish();
    g_times.push_back(cpu_milliseconds() - g_began);
}

// ---------------------------------------------------------------------------------------- chains
struct Measured {
    std::string name;
    Chain chain;
    std::vector<std::string> steps;                        // "0.joint_blur.gather", in plan order
    std::vector<std::map<std::string, double>> of_frames;  // least milliseconds of each step

    double mean_ms(const std::string& step) const {
        double sum = 0;
        for (const auto& times : of_frames) {
            const auto time = times.find(step);
            if (time != times.end()) sum += time->second;
        }
        return sum / double(of_frames.size());
    }
};

Chain chain_of(const std::string& name) {
    if (name == "guertin") {
        auto file = parse_chain("{postchain: 1, passes: [motion_blur: {mode: guertin}]}", name,
                                builtin_passes());
        require(file.status());
        return std::move(file.chain);
    }
    if (builtin_passes().find(name)) {
        Chain chain;
        chain.append(builtin_passes(), name);
        return chain;
    }
    auto file = require(load_chain(name, builtin_passes()));
    require(file.status());
    return std::move(file.chain);
}

// ---------------------------------------------------------------------------------------- frames
std::vector<Frame> synthetic_frame(int width, int height) {
    BenchFrame made = make_frame(width, height);
    std::vector<Frame> frames;
    frames.push_back({made.description, {}});
    for (auto& [role, plane] : made.planes)
        frames.back().planes[role] = std::make_shared<const ImageF>(std::move(plane));
    return frames;
}

void measure(Measured& one, size_t f, const Frame& frame, Executor& executor) {
    FrameDescription description = frame.description;
    find_depths(one.chain, frame.planes, description);
    const Plan plan =
        require(make_plan(one.chain, description, {.device = executor.device_class()}));
    g_times.clear();
    require(executor.filter(plan, frame.planes));
    if (g_times.size() != plan.steps.size()) fail(one.name + ": not one debug group for each step");
    one.of_frames.resize(std::max(one.of_frames.size(), f + 1));
    for (size_t i = 0; i < plan.steps.size(); ++i) {
        const Step& step = plan.steps[i];
        const std::string name = concat(step.pass, ".", plan.name_of(step));
        if (std::find(one.steps.begin(), one.steps.end(), name) == one.steps.end())
            one.steps.push_back(name);
        const auto [known, is_new] = one.of_frames[f].emplace(name, g_times[i]);
        known->second = std::min(known->second, g_times[i]);
    }
}

// ---------------------------------------------------------------------------------------- tables
struct Sums {
    double fixed = 0;   // all that is neither of the next two
    double gather = 0;  // the steps of this name
    double after = 0;   // denoising, FXAA
    double sum() const { return fixed + gather + after; }
};

Sums sums_of(const Measured& one) {
    Sums sums;
    for (const std::string& step : one.steps) {
        const std::string last = step.substr(step.rfind('.') + 1);
        double& part = last.starts_with("gather")                              ? sums.gather
                       : last == "denoise" || step.find(".fxaa.") != step.npos ? sums.after
                                                                               : sums.fixed;
        part += one.mean_ms(step);
    }
    return sums;
}

void print_steps(const Measured& one) {
    std::printf("\n| %s | ms |\n|---|---|\n", one.name.c_str());
    for (const std::string& step : one.steps)
        std::printf("| %s | %.1f |\n", step.c_str(), one.mean_ms(step));
}

void print_sums(const std::vector<Measured>& all, double guertin, double paper) {
    std::printf(
        "\n| ms, ratios | fixed steps | gather | denoise, FXAA | sum | fixed / guertin | gather / "
        "guertin | sum / guertin | sum / paper |\n|---|---|---|---|---|---|---|---|---|\n");
    for (const Measured& one : all) {
        const Sums s = sums_of(one);
        std::printf("| %s | %.1f | %.1f | %.1f | %.1f | %.2f | %.2f | %.2f | %.2f |\n",
                    one.name.c_str(), s.fixed, s.gather, s.after, s.sum(), s.fixed / guertin,
                    s.gather / guertin, s.sum() / guertin, s.sum() / paper);
    }
}

nlohmann::ordered_json json_of(const std::vector<Measured>& all, const std::string& device,
                               int iterations) {
    nlohmann::ordered_json chains;
    for (const Measured& one : all) {
        nlohmann::ordered_json steps;
        for (const std::string& step : one.steps)
            steps.push_back({{"step", step}, {"cpu_ms", one.mean_ms(step)}});
        const Sums s = sums_of(one);
        chains.push_back({{"chain", one.name},
                          {"steps", std::move(steps)},
                          {"fixed_ms", s.fixed},
                          {"gather_ms", s.gather},
                          {"after_ms", s.after},
                          {"sum_ms", s.sum()}});
    }
    return {{"postchain_steps_bench", 1},
            {"device", device},
            {"frames", all.front().of_frames.size()},
            {"iterations", iterations},
            {"chains", std::move(chains)}};
}

}  // namespace

int main(int argc, char** argv) {
    Arguments arguments(argc, argv,
                        concat("steps_bench [--input=FRAMES [--frames=1-4] [--camera=FILE]] ",
                               kSettingsUsage, " [--steps] [--first] [--json=FILE] [CHAIN...]"));
    const Settings settings = take_settings(arguments, 3);
    const Shot input = take_shot(arguments);
    const std::string json = arguments.text("--json").value_or("");
    const bool steps = arguments.flag("--steps"), first = arguments.flag("--first");
    std::vector<std::string> names = {"guertin", "paper"};
    for (const std::string& word : arguments.words())
        if (std::find(names.begin(), names.end(), word) == names.end()) names.push_back(word);
    if (names.size() == 2)
        for (const char* name : {"motion_blur", "depth_of_field", "fast", "balanced", "best"})
            names.push_back(name);
    std::vector<Measured> all;
    RoleSet wanted;
    for (const std::string& name : names) {
        all.push_back({name, chain_of(name), {}, {}});
        wanted = wanted | all.back().chain.required() | all.back().chain.optional();
    }
    const auto context = require(egl::Context::create({}));
    epoxy_glPushDebugGroup = begin_step;
    epoxy_glPopDebugGroup = end_step;
    Executor executor(context->device(), {.labels = true});
    const std::vector<Frame> frames = input.pattern.empty()
                                          ? synthetic_frame(settings.width, settings.height)
                                          : read_shot(input, wanted);
    // The first run compiles. A program that an earlier chain has too is compiled there.
    for (Measured& one : all) {
        measure(one, 0, frames[0], executor);
        if (first) print_steps({one.name + ", first dispatch", {}, one.steps, one.of_frames});
        one.of_frames.clear();
    }
    for (int i = 0; i < settings.iterations; ++i)
        for (size_t f = 0; f < frames.size(); ++f)
            for (Measured& one : all) measure(one, f, frames[f], executor);
    const std::string device = device_text(context->device());
    std::printf("%s; %zu frame(s) of %dx%d, least of %d\n", device.c_str(), frames.size(),
                frames[0].description.width, frames[0].description.height, settings.iterations);
    if (steps)
        for (const Measured& one : all) print_steps(one);
    print_sums(all, sums_of(all[0]).sum(), sums_of(all[1]).sum());
    if (!json.empty()) {
        std::ofstream file(json);
        file << json_of(all, device, settings.iterations).dump(1) << "\n";
        if (!file.flush()) fail(json + ": cannot be written");
    }
    return 0;
}
