// Prints what the compiler of GPUs that are not present makes of the steps of the shipped chains,
// as a Markdown table: Mesa's RADV, for generations of AMD. For an engine's frame with neighbors
// and without known facts. A cell: vector registers / waves that a SIMD holds at once / spilled
// vector registers / instructions.
//
//   isa_bench [--generation=NAME]... [--steps] [--back] [CHAIN...]
//
// --steps: every step, otherwise the three largest of a chain. --back: frames have motion_back too.
// Needs no GL and no GPU. Exit code 1: a step is not compiled; 77: a compiler is missing.
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

#include "tests/bench/amd_compiler.h"
#include "tests/bench/engine_plan.h"

namespace {

using namespace postchain;
using namespace postchain::bench;

constexpr int kSkipped = 77;
constexpr size_t kLargest = 3;

struct Program {
    std::string name;  // of its first step: "joint_blur.gather"
    ProgramKey key;
};

// The programs of `chain`, in the order of its plan, each once.
std::vector<Program> programs_of(const std::string& chain, bool back) {
    FrameDescription frame = engine_frame(1920, 1080);
    if (back) frame.planes = frame.planes | kMotionBack;
    const Plan plan = plan_of(chain, frame, {.device = DeviceClass::gpu});
    std::vector<Program> programs;
    for (const Step& step : plan.steps)
        if (std::none_of(programs.begin(), programs.end(),
                         [&](const Program& other) { return other.key == step.program; }))
            programs.push_back({plan.name_of(step), step.program});
    return programs;
}

struct Row {
    std::string step;
    uint64_t instructions = 0;       // of the first generation
    std::vector<std::string> cells;  // of each generation
};

Row row_of(const Program& program, const std::vector<std::unique_ptr<AmdCompiler>>& compilers) {
    Row row;
    row.step = program.name;
    const std::vector<uint32_t> spirv = spirv_of(program.key);
    for (const auto& compiler : compilers) {
        const auto found = compiler->compile(spirv);
        if (!found.ok()) fail(program.name + ": " + found.status().message(), 1);
        const auto value = [&](const char* name) {
            const auto one = found->statistics.find(name);
            if (one == found->statistics.end())
                fail(concat("this RADV states no '", name, "'"), kSkipped);
            return one->second;
        };
        const uint64_t instructions = value("Instructions");
        if (row.cells.empty()) row.instructions = instructions;
        row.cells.push_back(concat(value("VGPRs"), " / ", value("Subgroups per SIMD"), " / ",
                                   value("Spilled VGPRs"), " / ", instructions));
    }
    return row;
}

}  // namespace

int main(int argc, char** argv) {
    Arguments arguments(argc, argv,
                        "isa_bench [--generation=NAME]... [--steps] [--back] [CHAIN...]");
    std::vector<std::string> generations = arguments.texts("--generation");
    const bool steps = arguments.flag("--steps"), back = arguments.flag("--back");
    std::vector<std::string> chains = arguments.words();
    if (chains.empty()) chains = shipped_chains();
    if (generations.empty()) generations = {"vega10", "navi21", "gfx1100"};
    if (std::system("glslangValidator --version >/dev/null 2>&1") != 0)
        fail("glslangValidator is not installed", kSkipped);
    std::vector<std::unique_ptr<AmdCompiler>> compilers;
    for (const std::string& generation : generations) {
        auto made = AmdCompiler::create(generation);
        if (!made.ok()) fail(made.status().message(), kSkipped);
        compilers.push_back(std::move(*made));
    }
    std::printf("| chain | step |");
    for (const std::string& generation : generations) std::printf(" %s |", generation.c_str());
    std::printf("\n|---|---|");
    for (size_t i = 0; i < generations.size(); ++i) std::printf("---|");
    std::printf("\n");
    for (const std::string& chain : chains) {
        std::vector<Row> rows;
        for (const Program& program : programs_of(chain, back))
            rows.push_back(row_of(program, compilers));
        std::stable_sort(rows.begin(), rows.end(), [](const Row& a, const Row& b) {
            return a.instructions > b.instructions;
        });
        for (size_t i = 0; i < (steps ? rows.size() : std::min(rows.size(), kLargest)); ++i) {
            std::printf("| %s | %s |", chain.c_str(), rows[i].step.c_str());
            for (const std::string& cell : rows[i].cells) std::printf(" %s |", cell.c_str());
            std::printf("\n");
        }
    }
    return 0;
}
