// The cost of a frame in the steady state: GL calls by kind, objects, and allocations. Every
// pc_run() is counted separately.
//
// GUEST_FRAMES: number of frames, fewer for a quick look; the test runs 1000.
#include <epoxy/gl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <regex>
#include <set>
#include <vector>

#include "tests/guest/allocations.h"
#include "tests/guest/gl_calls.h"
#include "tests/guest/host.h"

namespace postchain::test::count_test {
namespace {

using ::testing::StartsWith;

constexpr const char* kPasses = "motion_blur,fxaa,depth_of_field";

int frames() {
    const char* text = std::getenv("GUEST_FRAMES");
    return text ? std::atoi(text) : 1000;
}

pc_counters count(const pc::Instance& guest) {
    auto counters = pc::make<pc_counters>();
    EXPECT_EQ(pc_count(guest.get(), &counters), PC_OK);
    return counters;
}

bool makes_waits_or_reads(const std::string& name) {
    return name.starts_with("glGet") || name.starts_with("glIs") || name.starts_with("glCreate") ||
           name.starts_with("glDelete") || name.starts_with("glFinish") ||
           name.starts_with("glCompile") || name.starts_with("glLink") ||
           name.find("Storage") != std::string::npos || name.find("Debug") != std::string::npos ||
           name.find("Label") != std::string::npos;
}

// The frame's calls, without those of the fence that every fourth frame makes, asks and deletes.
// They are added to `fences`.
std::map<std::string, uint64_t> calls_of_frame(uint64_t& fences) {
    auto calls = GlCalls::stop();
    for (const char* name : {"glFenceSync", "glClientWaitSync", "glDeleteSync"}) {
        EXPECT_LE(calls[name], 1u) << name;
        fences += calls[name];
        calls.erase(name);
    }
    return calls;
}

uint64_t sum(const std::map<std::string, uint64_t>& calls) {
    uint64_t all = 0;
    for (const auto& [name, number] : calls) all += number;
    return all;
}

// One frame of each kind that a game draws: plain, jittered, converted from its own conventions.
std::vector<pc_frame> kinds_of(const HostFrameTextures& host, const HostTexture& output) {
    pc_frame plain = host.frame, jittered = host.frame, turned = host.frame;
    jittered.flags |= PC_MOTION_JITTERED;
    turned.flags = 0;
    turned.output = output;
    turned.pre_exposure = 1.5f;
    return {plain, jittered, turned};
}

void vary(pc_frame& frame, int i) {
    frame.frame_number = uint64_t(i);
    frame.jitter_px[0] = float(i % 8) / 8;
    if (frame.pre_exposure > 0) frame.pre_exposure = 1 + float(i % 5);
    frame.motion_scale[0] = 1 + float(i % 3);
}

void steady(const pc::Instance& guest, const pc::Chain& made, const HostFrameTextures& host,
            const HostTexture& output) {
    auto kinds = kinds_of(host, output);
    for (auto& frame : kinds) {
        vary(frame, 1);
        for (int again = 0; again < 2; ++again) prepare_and_run(guest, made, frame);
    }
    const pc_counters before = count(guest);
    uint64_t calls_per_frame[3] = {}, fences = 0;
    for (int i = 0; i < frames(); ++i) {
        pc_frame& frame = kinds[size_t(i % 3)];
        vary(frame, 4 * i + 1 + (i % 3 == 0 ? 0 : i));
        if (i % 3 == 0) frame.motion_scale[0] = 1;  // in place
        GlCalls::start();
        const uint64_t made_before = allocations();
        const pc_result result = pc_run(guest.get(), made.get(), &frame, nullptr);
        const uint64_t made_here = allocations() - made_before;
        const auto calls = calls_of_frame(fences);
        ASSERT_EQ(result, PC_OK) << pc_last_error(guest.get());
        if (i < 6) continue;  // the first plans of each variation
        ASSERT_EQ(made_here, 0u) << "frame " << i;
        for (const auto& [name, number] : calls)
            ASSERT_FALSE(makes_waits_or_reads(name)) << name << ", frame " << i;
        uint64_t& per_frame = calls_per_frame[i % 3];
        if (per_frame == 0) per_frame = sum(calls);
        ASSERT_EQ(sum(calls), per_frame) << "frame " << i;
    }
    EXPECT_LE(fences, 3u * (unsigned(frames()) / 4 + 1));
    const pc_counters after = count(guest);
    EXPECT_EQ(after.texture_allocations, before.texture_allocations);
    EXPECT_EQ(after.textures_alive, before.textures_alive);
    EXPECT_EQ(after.programs, before.programs);
    std::printf("GL calls a frame: %llu in place, %llu jittered, %llu converted; barriers %.1f\n",
                (unsigned long long)calls_per_frame[0], (unsigned long long)calls_per_frame[1],
                (unsigned long long)calls_per_frame[2],
                double(after.barriers - before.barriers) / double(after.frames - before.frames));
}

TEST(Count, TheSteadyStateMakesAllocatesAndReadsNothing) {
    const auto host = canonical_frame(64, 48);
    const HostTexture output(GL_RGBA8, 64, 48);
    for (const bool papers : {false, true}) {
        const auto guest = instance(0, PC_STATE_RESET);
        steady(guest, papers ? paper_chain() : chain(kPasses), host, output);
    }
}

// One before each of the ten levels but the first, and one at the end (chain/levels.h).
TEST(Count, ThePapersChainHasTenBarriers) {
    const auto host = canonical_frame(64, 48);
    const auto guest = instance();
    const auto made = paper_chain("motion_blur,depth_of_field,fxaa");
    prepare_and_run(guest, made, host.frame);
    const uint64_t before = count(guest).barriers;
    ASSERT_EQ(pc_run(guest.get(), made.get(), &host.frame, nullptr), PC_OK);
    EXPECT_EQ(count(guest).barriers - before, 10u);
}

// Restoring reads state first: a fixed number of glGet calls in each frame, and no allocation.
TEST(Count, RestoringReadsTheSameEveryFrame) {
    const auto host = canonical_frame(64, 48);
    const auto guest = instance();
    const auto made = chain(kPasses);
    for (int again = 0; again < 2; ++again) prepare_and_run(guest, made, host.frame);
    std::map<std::string, uint64_t> first;
    uint64_t fences = 0;
    for (int i = 0; i < 20; ++i) {
        GlCalls::start();
        const uint64_t made_before = allocations();
        ASSERT_EQ(pc_run(guest.get(), made.get(), &host.frame, nullptr), PC_OK);
        const uint64_t made_here = allocations() - made_before;
        const auto calls = calls_of_frame(fences);
        EXPECT_EQ(made_here, 0u);
        if (i == 0) first = calls;
        EXPECT_EQ(calls, first);
        EXPECT_EQ(calls.count("glGetError") + calls.count("glFinish") + calls.count("glIsTexture"),
                  0u);
    }
    EXPECT_GT(sum(first), 100u);
}

// New values are written in place, and nothing is planned, allocated or created. Lens, shutter,
// clip planes, bounds and noise change in every frame.
void changes_values_alone(const pc::Chain& made, const HostFrameTextures& host) {
    const auto guest = instance(0, PC_STATE_RESET);
    pc_frame first = host.frame;
    first.max_speed_px = 100;
    prepare_and_run(guest, made, first);
    const pc_counters before = count(guest);
    uint64_t fences = 0;
    for (int i = 1; i <= 50; ++i) {
        pc_frame frame = first;
        frame.frame_number = uint64_t(i);
        frame.focus_distance *= 1 + 0.001f * float(i);
        frame.f_stop *= 1 + 0.001f * float(i % 7);
        frame.shutter_frames = 0.4f + 0.01f * float(i % 5);
        frame.max_speed_px = 100 + float(i);
        GlCalls::start();
        const uint64_t made_before = allocations();
        const pc_result result = pc_run(guest.get(), made.get(), &frame, nullptr);
        const uint64_t made_here = allocations() - made_before;
        const auto calls = calls_of_frame(fences);
        ASSERT_EQ(result, PC_OK) << pc_last_error(guest.get());
        ASSERT_EQ(made_here, 0u) << "frame " << i;
        for (const auto& [name, number] : calls) ASSERT_FALSE(makes_waits_or_reads(name)) << name;
    }
    const pc_counters after = count(guest);
    EXPECT_EQ(after.plans_made, before.plans_made);
    EXPECT_EQ(after.texture_allocations, before.texture_allocations);
    EXPECT_EQ(after.programs, before.programs);
}

TEST(Count, ValuesThatChangePlanAndAllocateNothing) {
    const auto host = canonical_frame(64, 48);
    for (const char* noise : {"halton", "blue"}) {
        for (const bool papers : {false, true}) {
            const auto made = papers ? paper_chain() : chain(kPasses);
            set(made, 0, "animate_noise", 1);
            ASSERT_EQ(pc_chain_set_text(made.get(), 0, "noise", noise), PC_OK);
            changes_values_alone(made, host);
        }
        const auto joint = chain("joint_blur,fxaa");
        set(joint, 0, "animate_noise", 1);
        changes_values_alone(joint, host);
    }
}

// A closed shutter and a cut skip passes. Their plans have other shapes and are kept together.
TEST(Count, ShapesThatAreKnownPlanAndAllocateNothing) {
    const auto host = canonical_frame(64, 48);
    const auto guest = instance(0, PC_STATE_RESET);
    const auto made = chain(kPasses);
    prepare_and_run(guest, made, host.frame);
    uint64_t plans = 0;
    for (int i = 0; i < 40; ++i) {
        pc_frame frame = host.frame;
        frame.focus_distance *= 1 + 0.001f * float(i);
        if (i % 4 == 1) frame.shutter_frames = -1;
        if (i % 4 == 2) frame.flags |= PC_CAMERA_CUT;
        if (i % 4 == 3) frame.f_stop = 1e6f;
        const uint64_t made_before = allocations();
        const pc_result result = pc_run(guest.get(), made.get(), &frame, nullptr);
        const uint64_t made_here = allocations() - made_before;
        ASSERT_EQ(result, PC_OK) << pc_last_error(guest.get());
        if (i == 7) plans = count(guest).plans_made;
        if (i > 7) {
            ASSERT_EQ(made_here, 0u) << "frame " << i;
        }
    }
    EXPECT_EQ(count(guest).plans_made, plans);
}

// Chains of the same passes that run in turn, as those of several views, have a plan each.
TEST(Count, ChainsOfOneShapeKeepTheirPlans) {
    const auto host = canonical_frame(64, 48);
    const auto guest = instance(0, PC_STATE_RESET);
    constexpr size_t kChains = 12;
    std::vector<pc::Chain> chains;
    for (size_t i = 0; i < kChains; ++i) {
        chains.push_back(chain(kPasses));
        set(chains[i], PC_CAMERA, "shutter_frames", 0.3 + 0.05 * double(i));
        prepare_and_run(guest, chains[i], host.frame);
    }
    const pc_counters before = count(guest);
    for (size_t i = 0; i < 3 * kChains; ++i) {
        const uint64_t already = allocations();
        const pc_result result =
            pc_run(guest.get(), chains[i % kChains].get(), &host.frame, nullptr);
        const uint64_t made_here = allocations() - already;
        ASSERT_EQ(result, PC_OK) << pc_error();
        EXPECT_EQ(made_here, 0u) << "frame " << i;
    }
    EXPECT_EQ(count(guest).plans_made, before.plans_made);
    EXPECT_EQ(count(guest).texture_allocations, before.texture_allocations);
}

// A cut, a closed shutter, a long focus pull, bounds, matrices, gain: none was there when
// pc_prepare() compiled the programs.
void compiles_nothing_after_prepare(const pc::Chain& made) {
    const auto host = canonical_frame(64, 48);
    const auto guest = instance();
    ASSERT_EQ(pc_prepare(guest.get(), made.get(), &host.frame, 1), PC_OK);
    const uint64_t programs = count(guest).programs;
    const uint64_t textures = count(guest).texture_allocations;
    for (const uint32_t cut : {0u, uint32_t(PC_CAMERA_CUT)}) {
        for (const float shutter : {0.0f, -1.0f, 0.9f}) {
            for (const float stops :
                 {1.0f, 0.5f, 0.25f, 0.1f, 0.05f, 0.02f, 0.01f, 0.005f, 64.0f}) {
                for (const float focus : {0.3f, 1.0f, 3.0f, 40.0f}) {
                    pc_frame frame = host.frame;
                    frame.flags |= cut;
                    frame.shutter_frames = shutter;
                    frame.f_stop *= stops;
                    frame.focus_distance *= focus;
                    const pc_result result = pc_run(guest.get(), made.get(), &frame, nullptr);
                    // An impossible lens is an error of the chain and compiles nothing.
                    ASSERT_TRUE(result == PC_OK || result == PC_ERROR_CHAIN)
                        << pc_last_error(guest.get());
                }
            }
        }
    }
    pc_frame one_depth = host.frame, no_sky = host.frame, moving_sky = host.frame;
    one_depth.max_speed_px = 30;
    one_depth.nearest = one_depth.farthest = 2;
    no_sky.farthest = 100;
    for (int i = 0; i < 4; ++i) moving_sky.view_projection[5 * i] = 1;
    std::copy_n(moving_sky.view_projection, 16, moving_sky.other_view_projection);
    moving_sky.other_view_projection[8] = 0.1f;
    pc_frame brighter = moving_sky;
    brighter.pre_exposure = 1.5f;
    brighter.motion_scale[0] = 2;
    pc_frame cut = host.frame;
    cut.flags |= PC_CAMERA_CUT;
    for (const pc_frame& frame : {one_depth, no_sky, moving_sky, brighter, cut}) {
        EXPECT_EQ(pc_run(guest.get(), made.get(), &frame, nullptr), PC_OK)
            << pc_last_error(guest.get());
    }
    EXPECT_EQ(count(guest).programs, programs);
    // The textures for the cut existed before the first of these frames.
    const auto fresh = instance();
    ASSERT_EQ(pc_prepare(fresh.get(), made.get(), &host.frame, 1), PC_OK);
    ASSERT_EQ(count(fresh).texture_allocations, textures);
    ASSERT_EQ(pc_run(fresh.get(), made.get(), &cut, nullptr), PC_OK);
    EXPECT_EQ(count(fresh).texture_allocations, textures);
}

TEST(Count, NothingIsCompiledAfterPrepare) {
    compiles_nothing_after_prepare(chain(kPasses));
    // Radii up to a large part of the small image: downsampling by 1, 2 and 4, a program each.
    const auto paper = paper_chain();
    set(paper, 1, "max_radius_px", 40);
    compiles_nothing_after_prepare(paper);
}

// A window that is dragged through 100 sizes and back.
TEST(Count, ResizingDoesNotGrow) {
    const auto guest = instance();
    const auto made = chain(kPasses);
    const auto prepared = canonical_frame(64, 48);
    prepare_and_run(guest, made, prepared.frame);
    const uint64_t programs = count(guest).programs;
    uint64_t most = 0, most_bytes = 0;
    for (int i = 0; i < 100; ++i) {
        const auto host = canonical_frame(64 + i, 48 + i / 2);
        ASSERT_EQ(pc_run(guest.get(), made.get(), &host.frame, nullptr), PC_OK)
            << pc_last_error(guest.get());
        if (i == 15) {
            most = count(guest).textures_alive;
            most_bytes = count(guest).texture_bytes;
        }
        if (i > 15) {
            ASSERT_LE(count(guest).textures_alive, most * 5 / 4) << "size " << i;
            // Sizes grow to 2.5 times the area.
            ASSERT_LE(count(guest).texture_bytes, 4 * most_bytes) << "size " << i;
        }
    }
    EXPECT_EQ(count(guest).programs, programs);
    for (int i = 0; i < 20; ++i)
        ASSERT_EQ(pc_run(guest.get(), made.get(), &prepared.frame, nullptr), PC_OK);
    const auto fresh = instance();
    prepare_and_run(fresh, made, prepared.frame);
    EXPECT_EQ(count(guest).textures_alive, count(fresh).textures_alive);
    EXPECT_EQ(count(guest).texture_bytes, count(fresh).texture_bytes);
}

// Every GL function that chain/gl and chain/guest name is among those that are counted.
TEST(Count, EveryFunctionIsCounted) {
    const auto list = GlCalls::names();
    const std::set<std::string> counted(list.begin(), list.end());
    static const std::regex pattern(R"re(\b(gl[A-Z]\w*)\()re");
    size_t found = 0;
    for (const char* folder : {"chain/gl", "chain/guest"})
        for (const auto& entry :
             std::filesystem::directory_iterator(std::string(POSTCHAIN_SOURCE_DIR "/") + folder)) {
            std::ifstream in(entry.path());
            for (std::string line; std::getline(in, line);) {
                line = line.substr(0, line.find("//"));
                for (std::sregex_iterator it(line.begin(), line.end(), pattern), end; it != end;
                     ++it) {
                    ++found;
                    EXPECT_TRUE(counted.count((*it)[1])) << entry.path() << ": " << (*it)[1];
                }
            }
        }
    EXPECT_GT(found, 60u);
}

}  // namespace
}  // namespace postchain::test::count_test
