// Prints a Markdown table of bytes per pixel of chains, by pass and step, as
// chain/plan/plan_bytes.h counts them, for an engine's frame without known facts, in which
// everything may move, and the memory of its textures.
//
//   bytes_table [--halves] [--size=WIDTHxHEIGHT] CHAIN...
//
// --halves: color, motion and intermediate planes are half; depth is fp32. Needs no GL.
#include <cstdio>
#include <string>
#include <vector>

#include "chain/plan/plan_bytes.h"
#include "tests/bench/engine_plan.h"

namespace {

using namespace postchain;
using bench::fail;

FrameDescription described(int width, int height, bool halves) {
    FrameDescription frame = bench::engine_frame(width, height);
    frame.planes = {Role::color, Role::inverse_depth, Role::motion};
    frame.bounds.color_is_half = halves;
    return frame;
}

Plan plan_of(const std::string& name, const FrameDescription& frame, bool halves) {
    PlanOptions options;
    options.precision = halves ? Precision::fp16 : Precision::fp32;
    Plan plan = bench::plan_of(name, frame, options);
    if (halves)
        for (PlanTexture& texture : plan.textures)
            if (texture.imported && texture.role != Role::inverse_depth)
                texture.format = plane_format(channels_of(texture.format), Precision::fp16);
    return plan;
}

void print(const std::string& name, const Plan& plan, bool halves) {
    const double pixels = double(plan.width) * plan.height;
    const std::vector<StepBytes> bytes = bytes_of_steps(plan);
    std::printf("| %s, %s | read | written | B/px |\n|---|---|---|---|\n", name.c_str(),
                halves ? "halves" : "fp32");
    for (size_t i = 0; i < plan.passes.size(); ++i) {
        const double sum = bytes_per_pixel(plan, int(i));
        if (!plan.passes[i].elided)
            std::printf("| **%s** | | | **%.2f** |\n", plan.passes[i].type.c_str(), sum);
        for (size_t s = 0; s < plan.steps.size(); ++s)
            if (plan.steps[s].pass == int(i) && bytes[s].counts)
                std::printf("| %s | %.2f | %.2f | %.2f |\n", plan.steps[s].name.c_str(),
                            double(bytes[s].read) / pixels, double(bytes[s].written) / pixels,
                            double(bytes[s].moved()) / pixels);
    }
    std::printf("| **sum** | | | **%.2f** |\n\n", bytes_per_pixel(plan));
    Plan own = plan;
    std::erase_if(own.textures, [](const PlanTexture& texture) { return texture.imported; });
    std::printf(
        "%s, %s, %dx%d: textures of at most %.0f MB at a time, %.0f MB without the frame's\n\n",
        name.c_str(), halves ? "halves" : "fp32", plan.width, plan.height,
        double(plan.peak_bytes()) / 1e6, double(own.peak_bytes()) / 1e6);
}

}  // namespace

int main(int argc, char** argv) {
    const char* usage = "bytes_table [--halves] [--size=WIDTHxHEIGHT] CHAIN...";
    bench::Arguments arguments(argc, argv, usage);
    const bool halves = arguments.flag("--halves");
    const auto [width, height] = arguments.size(1920, 1080);
    const std::vector<std::string> chains = arguments.words();
    if (chains.empty()) fail(std::string("give a chain: ") + usage, 2);
    for (const std::string& chain : chains)
        print(chain, plan_of(chain, described(width, height, halves), halves), halves);
    return 0;
}
