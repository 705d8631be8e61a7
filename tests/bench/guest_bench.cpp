// Measures the CPU cost of a guest's frame on its host (docs/performance.md). GL is real while
// programs and textures are made; then every GL function is replaced by one that only counts. With
// --driver it stays: the driver's share, if its device is idle or left out (GALLIUM_NOOP=1 of
// Mesa).
#include <epoxy/gl.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <functional>
#include <postchain/postchain.hpp>
#include <vector>

#include "chain/egl/context.h"
#include "chain/guest/postchain_plan.h"
#include "tests/bench/arguments.h"
#include "tests/guest/allocations.h"
#include "tests/guest/gl_calls.h"

namespace postchain::test {
namespace {

using bench::fail;

constexpr int kFramesOfARepeat = 200;

struct NamedChain {
    const char* name;
    pc::Chain chain;
};

struct Value {
    uint32_t pass;
    const char* key;
    const char* value;
};

// The values of the shipped chain of that name (config/chains).
NamedChain make_chain(const char* name, const char* passes, std::initializer_list<Value> values) {
    NamedChain made{name, pc::chain(passes)};
    if (!made.chain) fail(pc_create_error());
    for (const auto& [pass, key, value] : values) {
        char* end = nullptr;
        const double number = std::strtod(value, &end);
        const pc_result result = *end ? pc_chain_set_text(made.chain.get(), pass, key, value)
                                      : pc_chain_set_number(made.chain.get(), pass, key, number);
        if (result != PC_OK) fail(pc_chain_error(made.chain.get()));
    }
    return made;
}

pc_texture make_texture(GLenum format, int width, int height) {
    GLuint name = 0;
    glCreateTextures(GL_TEXTURE_2D, 1, &name);
    glTextureStorage2D(name, 1, format, width, height);
    return {name, format, width, height, 0, 0};
}

pc_frame make_frame(int width, int height) {
    auto frame = pc::make<pc_frame>();
    frame.flags = PC_TOP_LEFT | PC_MOTION_TO_NEXT;
    frame.color = make_texture(GL_RGBA16F, width, height);
    frame.depth = make_texture(GL_R32F, width, height);
    frame.motion = make_texture(GL_RG16F, width, height);
    frame.output = make_texture(GL_RGBA16F, width, height);
    frame.depth_encoding = PC_DEPTH_INVERSE;
    frame.focal_length_mm = 50;
    frame.sensor_width_mm = 36;
    frame.f_stop = 2;
    frame.focus_distance = 4;
    return frame;
}

struct Kind {
    const char* name;
    std::function<void(pc_frame&, pc_chain*, int)> change;  // before frame i
};

std::vector<Kind> kinds() {
    return {{"as the last one", [](pc_frame&, pc_chain*, int) {}},
            {"its size changes",
             [](pc_frame& frame, pc_chain*, int i) {
                 frame.width = 1920 - 8 * (i % 97);
                 frame.height = 1080 - 8 * (i % 55);
             }},
            {"depth and vectors converted",
             [](pc_frame& frame, pc_chain*, int i) {
                 frame.depth_encoding = PC_DEPTH_REVERSE_INFINITE;
                 frame.near_clip = 0.1f;
                 frame.flags |= PC_MOTION_JITTERED;
                 frame.jitter_px[0] = 0.1f * float(i % 8);
             }},
            {"a parameter is set: planned", [](pc_frame&, pc_chain* chain, int i) {
                 pc_chain_set_number(chain, 0, "seed", i % 2);
             }}};
}

pc_counters counters_of(const pc::Instance& guest) {
    auto counters = pc::make<pc_counters>();
    pc_count(guest.get(), &counters);
    return counters;
}

// Microseconds of a frame, the quickest repeat first.
template <class Run>
std::vector<double> times_of(const Run& run, int repeats) {
    std::vector<double> times;
    for (int repeat = 0; repeat < repeats; ++repeat) {
        const auto start = std::chrono::steady_clock::now();
        for (int i = 0; i < kFramesOfARepeat; ++i) run(i);
        const std::chrono::duration<double, std::micro> time =
            std::chrono::steady_clock::now() - start;
        times.push_back(time.count() / kFramesOfARepeat);
    }
    std::sort(times.begin(), times.end());
    return times;
}

void measure(const NamedChain& chain, pc_state state, const Kind& kind, pc_frame frame, int repeats,
             bool driver) {
    auto info = pc::create_info();
    info.state = state;
    const pc::Instance guest = pc::create(info);
    if (!guest) fail(pc_create_error());
    const auto run = [&](int i) {
        kind.change(frame, chain.chain.get(), i);
        if (pc_run(guest.get(), chain.chain.get(), &frame, nullptr) != PC_OK)
            fail(pc_last_error(guest.get()));
    };
    kind.change(frame, chain.chain.get(), 0);
    if (pc_prepare(guest.get(), chain.chain.get(), &frame, 1) != PC_OK)
        fail(pc_last_error(guest.get()));
    silence_gl(!driver);
    for (int i = 0; i < kFramesOfARepeat; ++i) run(i);

    const pc_counters before = counters_of(guest);
    const uint64_t allocated = allocations();
    GlCalls::start();
    for (int i = 0; i < kFramesOfARepeat; ++i) run(i);
    uint64_t calls = 0;
    const uint64_t made = allocations() - allocated;
    for (const auto& [name, number] : GlCalls::stop()) calls += number;
    const pc_counters after = counters_of(guest);

    const std::vector<double> times = times_of(run, repeats);
    silence_gl(false);
    const auto a_frame = [](uint64_t number) { return double(number) / kFramesOfARepeat; };
    std::printf("%-9s %-8s %-28s %8.1f %8.1f %9.1f %9.1f %9.1f %12.1f %12.1f\n", chain.name,
                state == PC_STATE_RESTORE ? "restore" : "reset", kind.name, times.front(),
                times[times.size() / 2], a_frame(calls),
                a_frame(after.dispatches - before.dispatches),
                a_frame(after.barriers - before.barriers), a_frame(made),
                double(after.texture_bytes) * 1e-6);
}

// The same frame by pc_plan_frame(), whose steps the host executes.
void measure_plan(const NamedChain& chain, const Kind& kind, pc_frame frame, int repeats) {
    frame.color.internal_format = frame.output.internal_format = PC_FORMAT_RGBA16F;
    frame.depth.internal_format = PC_FORMAT_R32F;
    frame.motion.internal_format = PC_FORMAT_RG16F;
    auto info = pc::make<pc_plan_create_info>();
    info.api_version = PC_API_VERSION;
    info.max_width = 1920;
    info.max_height = 1080;
    pc_planner* planner = nullptr;
    if (pc_plan_create(&info, &planner) != PC_OK) fail(pc_error());
    auto plan = pc::make<pc_plan>();
    const auto run = [&](int i) {
        kind.change(frame, chain.chain.get(), i);
        if (pc_plan_frame(planner, chain.chain.get(), &frame, &plan) != PC_OK) fail(pc_error());
    };
    for (int i = 0; i < kFramesOfARepeat; ++i) run(i);
    const uint64_t allocated = allocations();
    for (int i = 0; i < kFramesOfARepeat; ++i) run(i);
    const double made = double(allocations() - allocated) / kFramesOfARepeat;
    const std::vector<double> times = times_of(run, repeats);
    std::printf("%-9s %-8s %-28s %8.1f %8.1f %9s %9u %9s %9.1f %12.1f\n", chain.name, "plan",
                kind.name, times.front(), times[times.size() / 2], "-", plan.step_count, "-", made,
                double(plan.slot_bytes) * 1e-6);
    pc_plan_destroy(planner);
}

}  // namespace
}  // namespace postchain::test

int main(int argc, char** argv) {
    using namespace postchain::test;
    postchain::bench::Arguments arguments(argc, argv, "guest_bench [--repeats=200] [--driver]");
    const int repeats = arguments.count("--repeats", 200);
    const bool driver = arguments.flag("--driver");
    arguments.none();
    const auto context = postchain::egl::Context::create();
    if (!context.ok()) fail(context.status().message());
    const pc_frame frame = make_frame(1920, 1080);
    std::printf(
        "pc_run() on %s, and pc_plan_frame(), 1920x1080; microseconds of the quickest and of the "
        "median of %d repeats "
        "of %d frames\n",
        driver ? (*context)->device().renderer.c_str() : "a GL that does nothing", repeats,
        kFramesOfARepeat);
    std::printf("%-9s %-8s %-28s %8s %8s %9s %9s %9s %12s %12s\n", "chain", "state", "frame",
                "least", "median", "GL calls", "steps", "barriers", "allocations", "textures, MB");
    for (const Kind& kind : kinds()) {
        const NamedChain chains[] = {
            make_chain("paper", "motion_blur,fxaa,depth_of_field",
                       {{0, "mode", "guertin"},
                        {0, "samples", "25"},
                        {0, "max_blur_px", "40"},
                        {1, "preset", "12"},
                        {1, "hint", "checkerboard"},
                        {1, "hint_gate", "tile"},
                        {2, "method", "gilham"},
                        {2, "downsample", "4"},
                        {2, "leak", "coc"}}),
            make_chain("balanced", "joint_blur,fxaa",
                       {{0, "samples", "32"}, {1, "mode", "directional"}})};
        for (const NamedChain& chain : chains) {
            measure(chain, PC_STATE_RESET, kind, frame, repeats, driver);
            measure(chain, PC_STATE_RESTORE, kind, frame, repeats, driver);
            measure_plan(chain, kind, frame, repeats);
        }
    }
    return 0;
}
