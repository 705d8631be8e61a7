// Estimates what the steps of chains cost on GPUs that are not here: a count, not a measurement,
// good to a factor of 1.5 to 2, to rank steps and to see whether a change helps.
//
//   program --RADV--> instructions of each part      \__ wave-instructions, texels, bytes
//   program with marks --software renderer--> visits /
//   plan --> levels                           all of these --published rates--> ms
//
//   gpu_cost [--size=WIDTHxHEIGHT | --input=FRAMES [--frames=2] [--camera=FILE]]
//            [--alone] [--halves] [--steps] [--parts] [--check] [CHAIN...]
//
// CHAIN: a shipped chain, a chain file, or a tier of a guest ("tier:fast"); default: the shipped
// chains. The frames are the typical ones of gpu_bench, alone, and their mean; with --input one of
// files, with the frames before and after it as neighbors if they are there, unless --alone. It is
// an engine's: no known facts. Counts are scaled to 1920x1080. A wave is 32 invocations; the
// longest of them counts (tests/bench/visit_marks.h). --halves: planes of half precision, as a
// guest may choose.
// --steps: a row of each step, otherwise of each chain. --parts: the costliest parts of each step.
// --check: rank correlation with the CPU times of the same steps on the software renderer.
// Needs no GPU. Exit code 77: a compiler is missing.
#include <epoxy/gl.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <map>
#include <numeric>

#include "chain/egl/context.h"
#include "chain/guest/presets.h"
#include "chain/pass/depth_at.h"
#include "chain/pass/resolved_chain.h"
#include "chain/plan/hazards.h"
#include "chain/plan/storage.h"
#include "tests/bench/amd_compiler.h"
#include "tests/bench/amd_listing.h"
#include "tests/bench/bench_frame.h"
#include "tests/bench/cost_model.h"
#include "tests/bench/engine_plan.h"
#include "tests/bench/shot.h"
#include "tests/bench/visit_marks.h"

namespace {

using namespace postchain;
using namespace postchain::bench;

constexpr int kSkipped = 77;
// Instructions of a load on a software renderer, which unpacks each lane's pixels.
constexpr double kLoad = 40;
constexpr double kPixels = 1920.0 * 1080;
const std::vector<std::string> kGenerations = {"navi21", "vega10", "gfx1100"};

// -------------------------------------------------------------------------------------- programs
// A program by its marked source, compiled for each generation.
class Programs {
  public:
    explicit Programs(const std::string& shaders) : shaders_(shaders) {
        for (const std::string& generation : kGenerations) {
            auto made = AmdCompiler::create(generation);
            if (!made.ok()) fail(made.status().message(), kSkipped);
            compilers_.push_back(std::move(*made));
        }
    }
    const std::vector<Listing>& listings(const ProgramKey& program) {
        std::vector<Listing>& known = known_[program.text()];
        if (!known.empty()) return known;
        const std::vector<uint32_t> spirv = spirv_of(program, shaders_);
        for (const auto& compiler : compilers_) {
            const auto compiled = compiler->compile(spirv);
            if (!compiled.ok()) fail(program.text() + ": " + compiled.status().message());
            if (compiled->assembly.empty()) fail("this RADV lists no assembly", kSkipped);
            known.emplace_back(compiled->assembly);
        }
        return known;
    }

  private:
    std::string shaders_;
    std::vector<std::unique_ptr<AmdCompiler>> compilers_;
    std::map<std::string, std::vector<Listing>> known_;
};

// ------------------------------------------------------------------------------ between the steps
// Called at the begin and the end of the executor's debug groups, one for each step.
struct Hooks {
    std::function<void(size_t)> begin, end;
    size_t step = 0;
} g_hooks;

void begin_step(GLenum, GLuint, GLsizei, const GLchar*) {
    glFinish();
    g_hooks.begin(g_hooks.step);
}

void end_step() {
    glFinish();
    g_hooks.end(g_hooks.step++);
}

// ---------------------------------------------------------------------------------------- a chain
Chain chain_of(const std::string& name) {
    if (name.starts_with("tier:"))
        return require(guest::make_tier(name.substr(5), builtin_passes()));
    auto file = require(load_chain(name, builtin_passes()));
    return std::move(file.chain);
}

struct Costs {
    std::string chain;  // and the frame
    Plan plan;
    std::vector<StepCost> steps;
};

void print_parts(const StepCost& step, const Listing& listing, const std::vector<double>& visits,
                 const std::vector<Mark>& marks) {
    const std::vector<double> times = listing.visits_of_parts(visits);
    const auto& parts = listing.parts();
    std::vector<size_t> order(parts.size());
    std::iota(order.begin(), order.end(), size_t(0));
    const auto cost = [&](size_t i) { return times[i] * parts[i].once.alu; };
    const Instructions sum = listing.total(visits);
    std::sort(order.begin(), order.end(), [&](size_t a, size_t b) { return cost(a) > cost(b); });
    std::printf("\n%s: instructions x visits of a wave, of %.0f\n", step.name.c_str(),
                sum.alu / step.waves);
    for (size_t i = 0; i < std::min<size_t>(order.size(), 12); ++i) {
        const ListedPart& part = parts[order[i]];
        std::string places;
        for (const auto& [mark, copies] : part.marks)
            places += " " + marks[size_t(mark)].place + (copies > 1 ? concat("*", copies) : "");
        std::printf("  %5.0f x %7.2f = %7.0f, %2.0f loads:%s\n", part.once.alu,
                    times[order[i]] / step.waves, cost(order[i]) / step.waves, part.once.loads,
                    places.empty() ? " -" : places.c_str());
    }
}

Costs costs_of(const std::string& name, const Frame& frame, const PlanOptions& options,
               Programs& programs, const std::vector<Mark>& marks, Executor& executor,
               VisitCounters& visits, bool parts) {
    Costs costs;
    costs.chain = name;
    const Chain chain = chain_of(name);
    FrameDescription description = frame.description;
    description.bounds = {};
    description.bounds.color_is_half = options.precision == Precision::fp16;
    find_depths(chain, frame.planes, description);
    costs.plan = require(make_plan(chain, description, options));
    const Plan& plan = costs.plan;
    costs.steps.resize(plan.steps.size());
    const std::vector<uint32_t> waits = waits_of(plan, share_storage(plan, {}).numbers());
    const double scale = kPixels / (double(plan.width) * plan.height);
    g_hooks.step = 0;
    g_hooks.begin = [&](size_t i) {
        const Listing& listing = programs.listings(plan.steps[i].program)[0];
        std::vector<uint32_t> latencies(kMostMarks, 0);
        for (const ListedPart& part : listing.parts())
            for (const auto& [mark, copies] : part.marks)
                latencies[size_t(mark)] = listing.loads_in(mark) ? kFetchNs : kSharedNs;
        visits.clear(latencies);
    };
    g_hooks.end = [&](size_t i) {
        const Step& step = plan.steps[i];
        StepCost& cost = costs.steps[i];
        const std::vector<double> counts = visits.counts();
        cost.name = plan.name_of(step);
        for (size_t m = 0; m < marks.size(); ++m)
            if (marks[m].kind == Mark::program) cost.waves += counts[m];
        double share = 1;  // of the frame's blocks that the list had
        if (step.work_list >= 0)
            share = std::min(1.0, kWave * cost.waves / (double(plan.width) * plan.height));
        for (const Listing& listing : programs.listings(step.program)) {
            const Instructions all = listing.total(counts);
            cost.instructions.push_back(scale * (all.alu + all.shared));
            if (cost.instructions.size() > 1) continue;
            cost.texels = scale * fetch_cost(plan, step, all);
            cost.bytes = scale * moved_bytes(plan, step, all, share);
        }
        // A software renderer does both sides of a branch, and a fetch is instructions too.
        std::vector<double> loops = counts;
        for (size_t m = 0; m < marks.size(); ++m)
            if (marks[m].kind == Mark::branch) loops[m] = -1;
        const Instructions software = programs.listings(step.program)[0].total(loops);
        cost.software = scale * (software.alu + software.shared + kLoad * software.loads);
        cost.longest_ms = visits.longest_ms();
        cost.waits = waits[i] != 0;
        if (parts && cost.waves > 0)
            print_parts(cost, programs.listings(step.program)[0], counts, marks);
        cost.waves *= scale;
    };
    require(executor.filter(plan, frame.planes));
    if (g_hooks.step != plan.steps.size()) fail(name + ": not one debug group for each step");
    return costs;
}

// --------------------------------------------------------------------------------------- a table
void print_head() {
    std::printf("| chain, step | waves |");
    for (const std::string& generation : kGenerations) std::printf(" %s |", generation.c_str());
    std::printf(" texels | B/px | levels |");
    for (const Rates& on : kRates) std::printf(" %s |", on.name);
    std::printf("\n|---|");
    for (size_t i = 0; i < 4 + kGenerations.size() + std::size(kRates); ++i) std::printf("---|");
    std::printf("\n");
}

// `frames`: how many the steps are of; the row is their mean.
void print_row(const std::string& name, const std::vector<StepCost>& steps, double frames = 1) {
    double waves = 0, texels = 0, bytes = 0;
    int levels = 0;
    std::vector<double> instructions(kGenerations.size(), 0), ms(std::size(kRates), 0);
    for (const StepCost& step : steps) {
        waves += step.waves;
        texels += step.texels;
        bytes += step.bytes;
        levels += step.waits;
        for (size_t g = 0; g < instructions.size(); ++g) instructions[g] += step.instructions[g];
        for (size_t d = 0; d < ms.size(); ++d) ms[d] += step.ms(kRates[d]);
    }
    std::printf("| %s | %.0f |", name.c_str(), waves / frames);
    // Instructions are of a wave, which has 32 pixels.
    for (const double all : instructions) std::printf(" %.0f |", all * kWave / kPixels / frames);
    std::printf(" %.1f | %.0f | %.3g |", texels * kWave / kPixels / frames,
                bytes / kPixels / frames, levels / frames);
    for (const double one : ms) std::printf(" %.3g |", one / frames);
    std::printf("\n");
}

// ------------------------------------------------------------------------------------- the check
void measure_cpu(Costs& costs, const Frame& frame, Executor& executor) {
    for (int run = 0; run < 4; ++run) {  // the first compiles
        double began = 0;
        g_hooks.step = 0;
        g_hooks.begin = [&](size_t) { began = cpu_milliseconds(); };
        g_hooks.end = [&](size_t i) {
            const double ms = cpu_milliseconds() - began;
            double& least = costs.steps[i].cpu_ms;
            least = run <= 1 ? ms : std::min(least, ms);
        };
        require(executor.filter(costs.plan, frame.planes));
    }
}

void print_check(const std::vector<Costs>& all) {
    std::vector<double> model, cpu;
    double log_ratio = 0;
    for (const Costs& costs : all)
        for (const StepCost& step : costs.steps) {
            if (step.software == 0) continue;  // its list is empty
            model.push_back(step.software);
            cpu.push_back(step.cpu_ms);
            log_ratio += std::log(step.cpu_ms / model.back());
        }
    const double rate = std::exp(log_ratio / double(model.size()));
    double square = 0;
    size_t i = 0;
    std::printf("\n| chain, step | CPU ms | by count |\n|---|---|---|\n");
    for (const Costs& costs : all)
        for (const StepCost& step : costs.steps) {
            if (step.software == 0) continue;
            square += std::pow(std::log(cpu[i] / (rate * model[i])), 2);
            std::printf("| %s %s | %.2f | %.2f |\n", costs.chain.c_str(), step.name.c_str(), cpu[i],
                        rate * model[i]);
            ++i;
        }
    std::printf("\nrank correlation %.3f of %zu steps; factor of a step %.2f (one sigma)\n",
                rank_correlation(model, cpu), model.size(),
                std::exp(std::sqrt(square / double(model.size()))));
}

}  // namespace

int main(int argc, char** argv) {
    const char* usage =
        "gpu_cost [--size=WIDTHxHEIGHT | --input=FRAMES [--frames=2] [--camera=FILE]] [--alone] "
        "[--halves] [--steps] [--parts] [--check] [CHAIN...]";
    Arguments arguments(argc, argv, usage);
    const Shot shot = take_shot(arguments);
    const auto [width, height] = arguments.size(960, 540);
    const bool alone = arguments.flag("--alone"), halves = arguments.flag("--halves"),
               steps = arguments.flag("--steps"), parts = arguments.flag("--parts"),
               check = arguments.flag("--check");
    std::vector<std::string> chains = arguments.words();
    if (chains.empty()) chains = shipped_chains();
    if (std::system("glslangValidator --version >/dev/null 2>&1") != 0)
        fail("glslangValidator is not installed", kSkipped);
    PlanOptions options;
    options.device = DeviceClass::gpu;
    if (halves) options.precision = Precision::fp16;

    const auto context = require(egl::Context::create({}));
    epoxy_glPushDebugGroup = begin_step;
    epoxy_glPopDebugGroup = end_step;
    Executor software(context->device(), {.labels = true});
    const TemporaryFolder folder;
    const std::vector<Mark> marks = write_marked_shaders(folder.path());
    setenv("POSTCHAIN_SHADER_DIR", folder.path().c_str(), 1);
    Programs programs(folder.path());
    gl::Device device = context->device();
    device.software = false;  // the programs of a GPU
    Executor executor(device, {.labels = true});
    VisitCounters visits;

    RoleSet wanted;
    for (const std::string& name : chains) {
        const Chain chain = chain_of(name);
        wanted = wanted | chain.required() | chain.optional();
    }
    if (alone) wanted = without_neighbors(wanted);
    std::vector<std::pair<std::string, Frame>> frames;
    if (shot.pattern.empty())
        for (const auto& [scene, name] : kScenes) {
            BenchFrame made = make_frame(width, height, scene);
            Frame frame{made.description, {}};
            for (auto& [role, plane] : made.planes)
                frame.planes[role] = std::make_shared<const ImageF>(std::move(plane));
            frames.push_back({concat(" ", name), std::move(frame)});
        }
    else
        frames.push_back({"", read_shot(shot, wanted - kMotionBack).at(0)});
    std::printf(
        "A count, good to a factor of 1.5 to 2. Wave-instructions, texels and bytes of a pixel at "
        "1920x1080 (counted at %dx%d); ms.\n\n",
        frames[0].second.description.width, frames[0].second.description.height);
    print_head();
    std::vector<Costs> all;
    for (const std::string& name : chains) {
        std::vector<StepCost> sum;
        for (const auto& [title, frame] : frames) {
            Costs costs = costs_of(name, frame, options, programs, marks, executor, visits, parts);
            costs.chain += title;
            if (check) measure_cpu(costs, frame, software);
            print_row("**" + costs.chain + "**", costs.steps);
            for (size_t i = 0; steps && i < costs.steps.size(); ++i)
                print_row(costs.steps[i].name, {costs.steps[i]});
            sum.insert(sum.end(), costs.steps.begin(), costs.steps.end());
            all.push_back(std::move(costs));
        }
        if (frames.size() > 1) print_row("**" + name + "**, mean", sum, double(frames.size()));
    }
    if (check) print_check(all);
    return 0;
}
